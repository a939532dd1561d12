//! Many items on several threads, results in the order of the input.

use std::{
    collections::BTreeMap,
    sync::{Condvar, Mutex, mpsc},
    thread,
};

/// Items that may be worked on or wait, for each thread, ahead of the oldest
/// unfinished one: what bounds the memory.
const AHEAD_PER_JOB: usize = 4;

/// Who works on what.
struct Progress {
    next: usize,
    emitted: usize,
    stopped: bool,
}

/// Works on `items` with `jobs` threads and hands each result to `emit` in the
/// order of the items.
///
/// At most `4 · jobs` results wait at any time. When `emit` fails, the threads
/// finish what they are at and the error is returned.
pub(crate) fn in_order<I: Sync, T: Send, E>(
    items: &[I],
    jobs: usize,
    work: impl Fn(usize, &I) -> T + Sync,
    mut emit: impl FnMut(T) -> Result<(), E>,
) -> Result<(), E> {
    let progress = Mutex::new(Progress { next: 0, emitted: 0, stopped: false });
    let moved = Condvar::new();
    let ahead = jobs * AHEAD_PER_JOB;
    // the index of the next item, once it is near enough to the oldest unfinished one
    let claim = || {
        let mut state = progress.lock().expect("no thread panics while it holds the lock");
        loop {
            if state.stopped || state.next == items.len() {
                return None;
            }
            if state.next < state.emitted + ahead {
                state.next += 1;
                return Some(state.next - 1);
            }
            state = moved.wait(state).expect("no thread panics while it holds the lock");
        }
    };
    let note = |change: fn(&mut Progress)| {
        change(&mut progress.lock().expect("no thread panics while it holds the lock"));
        moved.notify_all();
    };
    thread::scope(|scope| {
        let (sender, results) = mpsc::channel();
        for _ in 0..jobs.min(items.len()) {
            let (sender, claim, work) = (sender.clone(), &claim, &work);
            scope.spawn(move || {
                while let Some(index) = claim() {
                    if sender.send((index, work(index, &items[index]))).is_err() {
                        return;
                    }
                }
            });
        }
        drop(sender);
        let mut waiting = BTreeMap::new();
        let mut due = 0;
        for (index, result) in results {
            waiting.insert(index, result);
            while let Some(result) = waiting.remove(&due) {
                if let Err(error) = emit(result) {
                    note(|state| state.stopped = true);
                    return Err(error);
                }
                due += 1;
                note(|state| state.emitted += 1);
            }
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use std::{
        convert::Infallible,
        sync::atomic::{AtomicUsize, Ordering},
        time::Duration,
    };

    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_items() {
        let items: Vec<u64> = (0..60).collect();
        for jobs in [1, 2, 7] {
            let mut seen = Vec::new();
            let slow_when_even = |_: usize, &item: &u64| {
                if item % 2 == 0 {
                    thread::sleep(Duration::from_micros(300));
                }
                item * 10
            };
            in_order(&items, jobs, slow_when_even, |result| {
                seen.push(result);
                Ok::<_, Infallible>(())
            })
            .unwrap();
            assert_eq!(seen, items.iter().map(|item| item * 10).collect::<Vec<_>>());
        }
    }

    #[test]
    fn no_more_wait_than_the_window_holds() {
        let items = [(); 100];
        let (jobs, finished, emitted) = (2, AtomicUsize::new(0), AtomicUsize::new(0));
        let work = |index: usize, (): &()| {
            if index == 0 {
                thread::sleep(Duration::from_millis(20));
            }
            finished.fetch_add(1, Ordering::SeqCst);
        };
        in_order(&items, jobs, work, |()| {
            let ahead = finished.load(Ordering::SeqCst) - emitted.load(Ordering::SeqCst);
            assert!(ahead <= jobs * AHEAD_PER_JOB, "{ahead}");
            emitted.fetch_add(1, Ordering::SeqCst);
            Ok::<_, Infallible>(())
        })
        .unwrap();
        assert_eq!(emitted.into_inner(), 100);
    }

    #[test]
    fn a_failing_end_stops_the_work() {
        let (items, done) = ([(); 1000], AtomicUsize::new(0));
        let work = |_: usize, (): &()| done.fetch_add(1, Ordering::SeqCst);
        let outcome = in_order(&items, 2, work, |_| Err("full"));
        assert_eq!(outcome, Err("full"));
        assert!(done.into_inner() <= 2 * AHEAD_PER_JOB + 2);
    }

    #[test]
    fn nothing_to_do_is_done() {
        in_order(&[(); 0], 3, |_, ()| (), |()| Err("never")).unwrap();
    }
}
