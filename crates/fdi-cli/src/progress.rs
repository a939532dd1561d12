//! How far a batch is: a line that is rewritten on a terminal, one line a stage elsewhere.
//!
//! Written with carriage returns and blanks alone, so that it looks the same where control
//! sequences are left out (`NO_COLOR`, `TERM=dumb`).

use std::{
    cell::RefCell,
    io::Write,
    panic::resume_unwind,
    sync::mpsc::{self, RecvTimeoutError},
    thread,
    time::{Duration, Instant},
};

use crate::Streams;

/// Progress of a batch on standard error.
#[derive(Debug)]
pub(crate) struct Progress {
    /// Recordings of the batch; nothing is told of one alone.
    total: usize,
    /// Recordings that an earlier run has done.
    before: usize,
    done: usize,
    /// Recordings that this run has done.
    now: usize,
    terminal: bool,
    began: Instant,
    /// Width of the line that stands on the terminal.
    drawn: usize,
}

impl Progress {
    /// Progress of a batch of `total` recordings, `before` of them done by an earlier run.
    pub(crate) fn new(total: usize, before: usize, terminal: bool) -> Self {
        Self { total, before, done: before, now: 0, terminal, began: clock(), drawn: 0 }
    }

    /// Says that the batch begins.
    pub(crate) fn begin(&mut self, err: &mut dyn Write) {
        if self.total < 2 {
            return;
        }
        if self.terminal {
            return self.draw(err);
        }
        let before = match self.before {
            0 => String::new(),
            count => format!(", {count} of them done before"),
        };
        let _ = writeln!(err, "diagnosing {} recordings{before}", self.total);
    }

    /// Takes the line away while something else is written.
    pub(crate) fn clear(&mut self, err: &mut dyn Write) {
        if self.drawn > 0 {
            let _ = write!(err, "\r{:1$}\r", "", self.drawn);
            let _ = err.flush();
            self.drawn = 0;
        }
    }

    /// Says that one recording more is done.
    pub(crate) fn step(&mut self, err: &mut dyn Write) {
        // one that an earlier run has done may have to be done again
        self.done = (self.done + 1).min(self.total);
        self.now += 1;
        if self.terminal && self.total > 1 {
            self.draw(err);
        }
    }

    /// Says that a recording is done that an earlier run has done.
    pub(crate) fn stay(&mut self, err: &mut dyn Write) {
        if self.terminal && self.total > 1 {
            self.draw(err);
        }
    }

    fn draw(&mut self, err: &mut dyn Write) {
        let line = told(self.done, self.total, self.now, self.began.elapsed());
        // blanks hide what is left of a longer line
        let _ = write!(err, "\r{line:0$}", self.drawn);
        let _ = err.flush();
        self.drawn = line.chars().count();
    }
}

/// Steps of long work: each a line as it begins, with the time that is left once that is known.
#[derive(Debug)]
pub(crate) struct Steps<'a, 's> {
    streams: RefCell<&'a mut Streams<'s>>,
    is_quiet: bool,
    began: Instant,
}

impl<'a, 's> Steps<'a, 's> {
    pub(crate) fn new(streams: &'a mut Streams<'s>, is_quiet: bool) -> Self {
        Self { streams: RefCell::new(streams), is_quiet, began: clock() }
    }

    /// Says that a step begins, when about this share of the time is over.
    pub(crate) fn tell(&self, what: &str, done: f64) {
        if !self.is_quiet {
            let left = left(self.began.elapsed().as_secs_f64(), done);
            self.streams.borrow_mut().say(format_args!("{what}{left}"));
        }
    }
}

/// The time that is left, in words, after so many seconds; nothing where that is not known yet.
fn left(seconds: f64, done: f64) -> String {
    if seconds < SOONEST_S || done <= 0.0 {
        return String::new();
    }
    format!(", about {} left", remaining(seconds * (1.0 - done) / done))
}

/// Does work that says nothing of how far it is: one line elsewhere, on a terminal one that counts the
/// time and is taken away. Quiet where that is asked for.
pub(crate) fn watched<T: Send>(
    streams: &mut Streams<'_>,
    is_quiet: bool,
    what: &str,
    work: impl FnOnce() -> T + Send,
) -> T {
    if is_quiet {
        return work();
    }
    if !streams.is_terminal {
        streams.say(format_args!("{what}"));
        return work();
    }
    let (began, mut drawn) = (clock(), 0);
    let (sender, finished) = mpsc::channel();
    let mut draw = |err: &mut dyn Write| {
        let line = format!("{what}, {}", remaining(began.elapsed().as_secs_f64().floor()));
        let _ = write!(err, "\r{line:drawn$}");
        let _ = err.flush();
        drawn = line.chars().count();
    };
    let outcome = thread::scope(|scope| {
        let worker = scope.spawn(move || {
            let outcome = work();
            // whoever waits may have gone
            let _ = sender.send(());
            outcome
        });
        loop {
            draw(streams.err);
            // ends with the work, also where that panics
            if finished.recv_timeout(TICK) != Err(RecvTimeoutError::Timeout) {
                return worker.join();
            }
        }
    });
    let _ = write!(streams.err, "\r{:drawn$}\r", "");
    let _ = streams.err.flush();
    outcome.unwrap_or_else(|panic| resume_unwind(panic))
}

/// Time before which the time that is left is a guess, s.
const SOONEST_S: f64 = 1.0;
/// Time between two looks at the clock.
const TICK: Duration = Duration::from_millis(500);

#[expect(clippy::disallowed_methods, reason = "the command line is where the clock is read")]
fn clock() -> Instant {
    Instant::now()
}

/// How far it is, how fast, and how long it will take.
fn told(done: usize, total: usize, by_now: usize, elapsed: Duration) -> String {
    let seconds = elapsed.as_secs_f64();
    let percent = 100 * done / total;
    if by_now == 0 || seconds <= 0.0 {
        return format!("{done} of {total} recordings, {percent} %");
    }
    let rate = by_now as f64 / seconds;
    let left = remaining((total - done) as f64 / rate);
    format!("{done} of {total} recordings, {percent} %, {rate:.1} a second, {left} left")
}

/// A time as people say it.
fn remaining(seconds: f64) -> String {
    let whole = seconds.ceil() as u64;
    match (whole / 3600, whole / 60 % 60, whole % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m} min {s} s"),
        (h, m, _) => format!("{h} h {m} min"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rate_and_remaining_time_are_those_of_this_run() {
        let after = |seconds: u64| Duration::from_secs(seconds);
        let line = "300 of 2000 recordings, 15 %, 10.0 a second, 2 min 50 s left";
        assert_eq!(told(300, 2000, 200, after(20)), line);
        assert_eq!(told(0, 2, 0, after(9)), "0 of 2 recordings, 0 %");
        assert!(told(1, 9000, 1, after(1)).ends_with("2 h 29 min left"));
        assert!(told(2, 2, 2, after(1)).ends_with("100 %, 2.0 a second, 0 s left"));
    }

    #[test]
    fn the_time_left_follows_from_the_share_that_is_over() {
        assert_eq!(left(6.0, 0.25), ", about 18 s left");
        assert_eq!(left(60.0, 0.25), ", about 3 min 0 s left");
        assert_eq!((left(6.0, 0.0), left(0.9, 0.5)), Default::default());
    }

    #[test]
    fn a_terminal_has_one_line_that_is_taken_away() {
        let mut progress = Progress::new(3, 0, true);
        let mut err = Vec::new();
        progress.begin(&mut err);
        for _ in 0..3 {
            progress.step(&mut err);
        }
        progress.clear(&mut err);
        let text = String::from_utf8(err).unwrap();
        assert!(!text.contains('\n') && !text.contains('\u{1b}'), "{text:?}");
        let lines: Vec<_> = text.split('\r').collect();
        assert_eq!(lines[1], "0 of 3 recordings, 0 %");
        assert!(lines[4].starts_with("3 of 3 recordings, 100 %, "), "{text:?}");
        // blanks over what was there
        assert_eq!(lines[5].trim(), "");
        assert!(lines[5].len() >= lines[4].trim_end().len());
    }

    #[test]
    fn work_that_is_watched_is_told_where_someone_wants_it() {
        let told = |is_terminal: bool, is_quiet: bool| {
            let (mut out, mut err) = (Vec::new(), Vec::new());
            let mut streams = Streams { out: &mut out, err: &mut err, is_terminal };
            assert_eq!(watched(&mut streams, is_quiet, "fitting 2 recordings", || 7), 7);
            String::from_utf8(err).unwrap()
        };
        assert_eq!(told(false, false), "fitting 2 recordings\n");
        assert_eq!((told(false, true), told(true, true)), (String::new(), String::new()));
        let terminal = told(true, false);
        assert!(terminal.starts_with("\rfitting 2 recordings, 0 s"), "{terminal:?}");
        assert!(terminal.ends_with(" \r") && !terminal.contains('\n'), "{terminal:?}");
    }

    #[test]
    fn elsewhere_it_is_one_line_and_of_one_recording_none() {
        let text = |total: usize, before: usize, terminal: bool| {
            let (mut progress, mut err) = (Progress::new(total, before, terminal), Vec::new());
            progress.begin(&mut err);
            progress.step(&mut err);
            progress.clear(&mut err);
            String::from_utf8(err).unwrap()
        };
        assert_eq!(text(3, 0, false), "diagnosing 3 recordings\n");
        assert_eq!(text(3, 2, false), "diagnosing 3 recordings, 2 of them done before\n");
        assert_eq!((text(1, 0, false), text(1, 0, true)), (String::new(), String::new()));
    }
}
