//! The whole chain on machines of this workspace's own simulation; machines that were written
//! apart are in `crates/greybox-blind`.

mod bench_top;
mod calibrate;
mod detection_limit;
mod explain;
mod propose;
mod signal_chain;
mod sound;
