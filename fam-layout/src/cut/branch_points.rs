//! Moving the vertex where three branches of a cut meet to where they are cheapest together.

use super::paths::Start;
use super::straightening::Straightening;

/// How much of the branches moves along with the point where they meet, as a fraction of the
/// longest: what is out of reach for much of them is tried with less.
const REACHES: [f64; 2] = [0.5, 0.125];

/// Moves the vertex that three branches start from to where they are cheapest together; whether
/// it found a better place.
pub(super) fn moved(state: &mut Straightening, branches: &[Vec<u32>]) -> bool {
    if branches.len() != 3 {
        return false;
    }
    let cost = |path: &Vec<u32>| path.iter().map(|&h| state.cost[h as usize]).sum::<f64>();
    let longest = branches.iter().map(cost).fold(0.0, f64::max);
    REACHES.iter().any(|reach| {
        let arms: Vec<&[u32]> = branches
            .iter()
            .map(|path| start_of(path, state.cost, reach * longest))
            .collect();
        match cheapest_star(state, &arms) {
            Some(star) => state.replace_if_alike(&arms.concat(), &star),
            None => false,
        }
    })
}

/// The first edges of a path, at least one, that cost no more than `reach`.
fn start_of<'a>(path: &'a [u32], cost: &[f64], reach: f64) -> &'a [u32] {
    let mut sum = 0.0;
    let within = path.iter().take_while(|&&h| {
        sum += cost[h as usize];
        sum <= reach
    });
    &path[..within.count().max(1)]
}

/// The cheapest paths from one vertex to the ends of three arms that meet neither the boundary
/// nor the rest of the cut.
fn cheapest_star(state: &Straightening, arms: &[&[u32]]) -> Option<Vec<u32>> {
    let topology = state.topology;
    let &[first, second, third] = arms else {
        return None;
    };
    let mut rest = state.cut.clone();
    rest.remove(topology, &arms.concat());
    let mut free: Vec<bool> = rest.vertices(topology).iter().map(|on| !on).collect();
    for (free, boundary) in free.iter_mut().zip(&state.boundary) {
        *free &= !boundary;
    }
    let end = |arm: &[u32]| arm.last().map(|&h| topology.target(h));
    let ends = [end(first)?, end(second)?, end(third)?];
    for v in ends {
        free[v as usize] = true;
    }
    let paths_from = |v: u32, limit: f64| {
        let search = state.search(limit);
        search
            .until(&[Start::At(v)], |_, to| free[to as usize], |_| false)
            .0
    };
    let cost = |arm: &[u32]| arm.iter().map(|&h| state.cost[h as usize]).sum::<f64>();
    let [a, b, c] = [cost(first), cost(second), cost(third)];
    // From a better centre the other two ends are at least as far as they are from each other;
    // were it farther than this from the first, the second or third would be no worse.
    let from_first = paths_from(ends[0], a + b.max(c));
    let apart = |i: usize, bound: f64| from_first.distance[ends[i] as usize].min(bound);
    let from_second = paths_from(ends[1], a + b + c - apart(2, a + c));
    let from_third = paths_from(ends[2], a + b + c - apart(1, a + b));
    let paths = [from_first, from_second, from_third];
    let sum = |v: u32| {
        let to = paths.iter().map(|paths| paths.distance[v as usize]);
        to.sum::<f64>()
    };
    let centre = (0..topology.vertices() as u32).min_by(|&a, &b| sum(a).total_cmp(&sum(b)))?;
    let star = paths.iter().map(|paths| paths.path_to(centre));
    sum(centre).is_finite().then(|| star.flatten().collect())
}
