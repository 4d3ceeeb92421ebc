use super::paths::{CheapestPaths, Start};
use super::straighten::Straightening;

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
    let all = arms.concat();
    let mut rest = state.cut.clone();
    rest.remove(topology, &all);
    let on_rest = rest.vertices(topology);
    let free = |v: u32| !on_rest[v as usize] && !state.boundary[v as usize];
    let search = state.search(all.iter().map(|&h| state.cost[h as usize]).sum());
    let paths: Vec<CheapestPaths> = arms
        .iter()
        .filter_map(|arm| arm.last())
        .map(|&h| topology.target(h))
        .map(|end| search.until(&[Start::At(end)], |_, v| free(v), |_| false).0)
        .collect();
    let sum = |v: &u32| {
        let to = paths.iter().map(|paths| paths.distance[*v as usize]);
        to.sum::<f64>()
    };
    let centre = (0..topology.vertices() as u32).min_by(|a, b| sum(a).total_cmp(&sum(b)))?;
    let star = paths.iter().map(|paths| paths.path_to(centre));
    sum(&centre).is_finite().then(|| star.flatten().collect())
}
