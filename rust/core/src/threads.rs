//! Work shared out among threads.

use std::num::NonZero;
use std::sync::Mutex;
use std::thread;

/// Do some work on each item, on so many threads; what comes of them, in their order.
pub(crate) fn in_order<T: Send, R: Send>(
    threads: NonZero<usize>,
    items: Vec<T>,
    work: impl Fn(T) -> R + Sync,
) -> Vec<R> {
    if threads.get() == 1 || items.len() < 2 {
        return items.into_iter().map(work).collect();
    }
    let threads = threads.get().min(items.len());
    let mut found: Vec<Option<R>> = items.iter().map(|_| None).collect();
    // Taken from the end: the first is the last.
    let queue: Vec<(T, &mut Option<R>)> = items.into_iter().zip(&mut found).rev().collect();
    let queue = Mutex::new(queue);
    let toil = || {
        loop {
            let next = queue.lock().map_or(None, |mut queue| queue.pop());
            let Some((item, slot)) = next else { return };
            *slot = Some(work(item));
        }
    };
    thread::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(toil);
        }
        toil();
    });
    found.into_iter().flatten().collect()
}
