//! Independent work on several threads.

use std::thread;

/// Applies a function to every item, on some threads; results stand in the order of the items,
/// whatever the number of threads.
///
/// # Errors
///
/// The first error in the order of the threads' shares.
///
/// # Panics
///
/// Where the function does.
pub fn in_parallel<T: Sync, R: Send, E: Send>(
    items: &[T],
    jobs: usize,
    work: impl Fn(usize, &T) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    let share = items.len().div_ceil(jobs.clamp(1, items.len().max(1))).max(1);
    let parts: Vec<Result<Vec<R>, E>> = thread::scope(|scope| {
        let work = &work;
        let handles: Vec<_> = items
            .chunks(share)
            .enumerate()
            .map(|(part, chunk)| {
                scope.spawn(move || -> Result<Vec<R>, E> {
                    chunk.iter().enumerate().map(|(i, x)| work(part * share + i, x)).collect()
                })
            })
            .collect();
        handles.into_iter().map(|handle| handle.join().expect("no work panics")).collect()
    });
    let mut results = Vec::with_capacity(items.len());
    for part in parts {
        results.extend(part?);
    }
    Ok(results)
}
