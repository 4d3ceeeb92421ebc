//! Work on many things of different sizes on all cores.

use std::cmp::Reverse;

/// What `work` makes of the things 0..n, in this order, where `sizes` has the size of each. The
/// largest are begun first, so that no core is left with a large one at the end.
pub fn largest_first<T: Send>(sizes: &[usize], work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let mut results: Vec<Option<T>> = sizes.iter().map(|_| None).collect();
    let mut places: Vec<(usize, &mut Option<T>)> = results.iter_mut().enumerate().collect();
    places.sort_by_key(|(i, _)| Reverse(sizes[*i]));
    // Idle threads take these in order, before they help with what a thing is divided into.
    rayon::scope_fifo(|scope| {
        for (i, place) in places {
            let work = &work;
            scope.spawn_fifo(move |_| *place = Some(work(i)));
        }
    });
    results.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[test]
    fn large_things_come_first_but_results_keep_their_order() {
        let sizes = [3, 900, 20, 1000, 20];
        let begun = Mutex::new(Vec::new());
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let results = alone.unwrap().install(|| {
            largest_first(&sizes, |i| {
                begun.lock().unwrap().push(i);
                10 * i
            })
        });
        assert_eq!(results, [0, 10, 20, 30, 40]);
        assert_eq!(begun.into_inner().unwrap(), [3, 1, 2, 4, 0]);
    }
}
