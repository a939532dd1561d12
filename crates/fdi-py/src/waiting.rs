//! Work without the interpreter's lock, which Ctrl-C ends and which never panics into Python.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
        mpsc::{self, RecvTimeoutError, SyncSender},
    },
    thread,
    time::Duration,
};

use pyo3::prelude::*;

use crate::error::{of_panic, plain};

/// Time between two looks for Ctrl-C.
const TICK: Duration = Duration::from_millis(50);
/// Messages that may wait: what bounds the memory.
const WAITING: usize = 1024;

/// Tells work that nobody waits for it any more.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stop(Arc<AtomicBool>);

impl Stop {
    pub(crate) fn is_asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    fn ask(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Message of a thread to the one that waits.
enum Told<M, T> {
    Message(M),
    Done(Result<T, String>),
}

/// Sends messages to the thread that waits.
pub(crate) struct Teller<M, T> {
    sender: SyncSender<Told<M, T>>,
    stop: Stop,
}

impl<M, T> Teller<M, T> {
    /// Sends a message; false where nobody waits any more.
    pub(crate) fn tell(&self, message: M) -> bool {
        !self.stop.is_asked() && self.sender.send(Told::Message(message)).is_ok()
    }

    /// True where nobody waits any more.
    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.is_asked()
    }
}

/// Does work here, with a panic turned into an error.
///
/// # Errors
/// `fdi.FdiError` for a panic, else what the work says.
pub(crate) fn guarded<T>(py: Python<'_>, work: impl FnOnce() -> PyResult<T>) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|panic| Err(plain(py, &of_panic(panic.as_ref()))))
}

/// Does work on a thread of its own, with the interpreter free for others. Messages are heard as
/// they come, with the interpreter's lock.
///
/// # Errors
/// `fdi.FdiError` for a panic, and what a signal handler raises: `KeyboardInterrupt`. The work
/// ends by itself when it next tells something.
pub(crate) fn waited<M: Send + 'static, T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Teller<M, T>) -> T + Send + 'static,
    mut hear: impl FnMut(Python<'_>, M) -> PyResult<()>,
) -> PyResult<T> {
    let (sender, receiver) = mpsc::sync_channel(WAITING);
    let stop = Stop::default();
    let teller = Teller { sender: sender.clone(), stop: stop.clone() };
    thread::spawn(move || {
        let done = catch_unwind(AssertUnwindSafe(|| work(&teller)));
        let done = done.map_err(|panic| of_panic(panic.as_ref()));
        // whoever waited may have gone
        let _ = sender.send(Told::Done(done));
    });
    let mut receiver = receiver;
    loop {
        let told;
        (told, receiver) = py.detach(move || (receiver.recv_timeout(TICK), receiver));
        let outcome = match told {
            Ok(Told::Message(message)) => hear(py, message),
            Ok(Told::Done(done)) => return done.map_err(|message| plain(py, &message)),
            Err(RecvTimeoutError::Timeout) => Ok(()),
            Err(RecvTimeoutError::Disconnected) => Err(plain(py, "the work ended without a word")),
        };
        if let Err(error) = outcome.and_then(|()| py.check_signals()) {
            stop.ask();
            return Err(error);
        }
    }
}
