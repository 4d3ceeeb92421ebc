//! Large patches: where to cut is found on a simpler surface.

use super::grow::Growth;
use super::problem::{Effort, Problem};
use super::shorten::shortened;
use super::tidy::{smoothed, straightened_nearby};
use super::{Goal, Report, START, Start, completed};
use crate::costs::creases::crease_costs;
use crate::cut::Cut;
use crate::patch::Patch;
use crate::simplify::{Simplification, Simplified};
use crate::solve::SolveError;
use crate::solve::layout::Layout;

/// Patches of at least this many triangles are simplified: a search on fewer is quick.
const LARGE: usize = 5_000;

/// About how many triangles simpler surfaces have. What is found depends on chance, so the best
/// of several is taken. The first takes about as long as the others together. With 3,000, 2,000
/// and 1,500 the searches take half as long again; at the usual bound seams are no shorter.
///
/// They are searched without the map, the last one once more along its tears: a map that
/// misleads makes no seam longer then, and one that leads well can make it shorter.
const SIMPLE: [usize; 3] = [2_000, 1_500, 1_000];

/// By how much a layout may miss the bound and still count as within it, as a share of what that is
/// above the energy of an isometry: so little is soon made up for by cutting further.
const SLACK: f64 = 0.05;

/// Newton steps over all triangles of the patch there may be once its cut is known: in most cases
/// far fewer are taken; where the simpler surface misled, some more cuts take all of them.
const STEPS: u64 = 120;

/// The solve along the cut of a simpler surface: nearly to its end, since branches are closed or
/// cuts made after it.
const CARRIED: Effort = Effort {
    iterations: 30,
    decrease: 1e-4,
};

/// Patches of at least this many triangles are cut, and seams shortened, on surfaces of about
/// `MIDDLE` triangles; after that they are only flattened along the cut. On five surfaces of 27,000 to
/// 278,000 triangles, 12,000 made seams as long and took up to half as long again; 6,000 made them
/// longer on three.
const HUGE: usize = 24_000;
const MIDDLE: usize = 8_000;

/// How often a cut is looked for there, each time with a lower bound.
const ATTEMPTS: usize = 3;

/// By how much the bound there is lowered, in units of what the whole surface misses it by.
const OVERSHOOT: f64 = 1.3;

/// What cuts cost along every half-edge of a patch, and where to start from.
type Guide<'a, 'b> = (&'a [f64], &'a Start<'b>);

/// A simpler surface, and the layout that was found for it.
struct Coarse<'a> {
    simplification: Simplification<'a>,
    simplified: Simplified,
    layout: Layout,
}

/// The same as [`super::found`], where the patch is large by way of simpler ones.
pub(super) fn found(
    problem: &mut Problem,
    start: &Start,
    goal: &Goal,
    budget: u64,
    report: &Report,
) -> Result<Layout, SolveError> {
    let patch = problem.patch;
    let count = patch.topology.triangles().len();
    if count >= HUGE && !matches!(start, Start::Layout(_)) {
        match by_way_of_middle(problem, start, goal, budget, report) {
            Ok(Some(layout)) => return Ok(layout),
            Ok(None) => {}
            Err(error) => return Err(error),
        }
    }
    let coarse = match cheapest(problem, start, goal, budget, report) {
        Ok(Some(coarse)) => coarse,
        Ok(None) => return super::found(problem, start, goal, budget, report),
        Err(error) => return Err(error),
    };
    let own = patch.without_forbidden(crease_costs(patch));
    let cost = std::mem::replace(&mut problem.cost, own);
    problem.injective = true;
    let mut layout = match carried(problem, coarse, goal, report) {
        Ok(layout) if problem.forbidden_edges(&layout) == 0 || !problem.goes_on() => layout,
        _ => {
            (problem.cost, problem.injective) = (cost, false);
            return super::found(problem, start, goal, budget, report);
        }
    };
    let spent = problem.work();
    let most = budget.min(STEPS * count as u64);
    let mut proceed = |problem: &Problem, layout: &Layout| {
        report(layout.energy, problem.length_of(layout)) && problem.work() - spent < most
    };
    if problem.goes_on() && layout.suits(goal.bound) {
        let mut proceed = |layout: &Layout| proceed(problem, layout);
        layout = shortened(problem, layout, goal.bound, &mut proceed);
    } else if problem.goes_on() {
        let growth = Growth::new(problem);
        layout = completed(problem, &growth, layout, goal, &mut proceed);
    }
    Ok(layout)
}

/// The same, where the patch is so large that its cut is also grown and shortened on a simpler
/// surface. `None` if that leads to no layout that is about within the bound.
fn by_way_of_middle(
    problem: &mut Problem,
    start: &Start,
    goal: &Goal,
    budget: u64,
    report: &Report,
) -> Result<Option<Layout>, SolveError> {
    let patch = problem.patch;
    let middle = Simplification::new(&patch.topology, &patch.positions, MIDDLE);
    if 2 * middle.triangles() > patch.topology.triangles().len() {
        return Ok(None);
    }
    let guided: Guide = (&problem.cost.clone(), start);
    let own = patch.without_forbidden(crease_costs(patch));
    let mut wanted = Goal { ..*goal };
    let mut best: Option<Layout> = None;
    for _ in 0..ATTEMPTS {
        let coarse = searched(
            problem,
            guided,
            &wanted,
            budget,
            middle.clone(),
            report,
            found,
        );
        let coarse = match coarse {
            Ok(coarse) => coarse,
            Err(SolveError::Unbounded) if problem.goes_on() => return Err(SolveError::Unbounded),
            Err(_) => break,
        };
        let reached = coarse.layout.energy;
        let cost = std::mem::replace(&mut problem.cost, own.clone());
        problem.injective = true;
        let layout = carried(problem, coarse, goal, report);
        (problem.cost, problem.injective) = (cost, false);
        let Ok(layout) = layout else { break };
        if problem.forbidden_edges(&layout) > 0 && problem.goes_on() {
            break;
        }
        let missed = layout.energy - goal.bound;
        if missed <= 0.0 || !problem.goes_on() {
            return Ok(Some(layout));
        }
        let is_better = |best: &Layout| layout.energy < best.energy;
        if best.as_ref().is_none_or(is_better) {
            best = Some(layout);
        }
        // What is finer adds to the energy.
        wanted.bound = reached.min(wanted.bound) - OVERSHOOT * missed;
        if wanted.bound <= 4.0 {
            break;
        }
    }
    let Some(layout) = best.filter(|layout| is_about_within(layout, goal.bound)) else {
        return Ok(None);
    };
    // What is left to be cut is too little for the simpler surface to show.
    (problem.cost, problem.injective) = (own, true);
    let limit = problem.work() + budget.min(STEPS * patch.areas.len() as u64);
    let mut proceed = |problem: &Problem, layout: &Layout| {
        report(layout.energy, problem.length_of(layout)) && problem.work() < limit
    };
    let growth = Growth::new(problem);
    Ok(Some(completed(
        problem,
        &growth,
        layout,
        goal,
        &mut proceed,
    )))
}

/// Of those found on simpler surfaces, the layout that misses the bound least, if at all by more
/// than [`SLACK`]; then that with the fewest forbidden edges, then that with the cheapest cut.
fn cheapest<'a>(
    problem: &Problem<'a>,
    start: &Start,
    goal: &Goal,
    budget: u64,
    report: &Report,
) -> Result<Option<Coarse<'a>>, SolveError> {
    let patch = problem.patch;
    let count = patch.topology.triangles().len();
    if count < LARGE || matches!(start, Start::Layout(_)) {
        return Ok(None);
    }
    let [first, others @ .., least] = SIMPLE;
    let least = Simplification::new(&patch.topology, &patch.positions, least);
    if 2 * least.triangles() > count {
        return Ok(None);
    }
    let creases = patch.without_forbidden(crease_costs(patch));
    let unguided: Guide = (&creases, &Start::Nothing);
    let on = |guide: Guide, simple: Simplification<'a>, report: &Report| {
        searched(problem, guide, goal, budget, simple, report, super::found)
    };
    let mut smaller = Vec::new();
    // Only one is reported, so that the reports are the same on every run.
    let first = rayon::in_place_scope(|scope| {
        let (least, smaller, on) = (&least, &mut smaller, &on);
        scope.spawn(move |_| {
            let silent = |_: f64, _: f64| problem.goes_on();
            let restored = others.iter().map(|&size| least.clone().restored(size));
            let simpler = restored.chain([least.clone()]);
            for simple in simpler.take_while(|_| problem.goes_on()) {
                smaller.extend(on(unguided, simple, &silent).ok());
            }
            if matches!(start, Start::Map(_)) && problem.goes_on() {
                let guide = (problem.cost.as_slice(), start);
                smaller.extend(on(guide, least.clone(), &silent).ok());
            }
        });
        on(unguided, least.clone().restored(first), report)
    });
    // Where it was broken off, the others did not have the same time.
    if !problem.goes_on() && first.is_ok() {
        smaller.clear();
    }
    if let Err(SolveError::Unbounded) = first
        && smaller.is_empty()
        && problem.goes_on()
    {
        return Err(SolveError::Unbounded);
    }
    let found = first.into_iter().chain(smaller);
    let best = found.reduce(|best, other| {
        let worth = |coarse: &Coarse| {
            let layout = &coarse.layout;
            let within = is_about_within(layout, goal.bound);
            let above = if within { 0.0 } else { layout.least_bound() };
            let simple = &coarse.simplified.patch;
            let is_forbidden = |&h: &u32| simple.forbidden[h as usize];
            let forbidden = layout.cut.half_edges().filter(is_forbidden).count();
            (above, forbidden, layout.cut.cost(&simple.prices))
        };
        if worth(&other) < worth(&best) {
            other
        } else {
            best
        }
    });
    Ok(best)
}

/// A layout of a simpler surface. `guide` is what cuts cost along the half-edges
/// of the patch, and where to start from.
fn searched<'a>(
    problem: &Problem<'a>,
    (cost, start): Guide,
    goal: &Goal,
    budget: u64,
    simplification: Simplification<'a>,
    report: &Report,
    found: impl Fn(&mut Problem, &Start, &Goal, u64, &Report) -> Result<Layout, SolveError>,
) -> Result<Coarse<'a>, SolveError> {
    let patch = problem.patch;
    let mut simplified = simplification.simplified(patch.scale);
    let costs = carried_costs(patch, cost, &simplified.patch);
    simplified.patch.forbidden = costs.iter().map(|cost| !cost.is_finite()).collect();
    simplified.patch.prices = carried_prices(patch, &simplified.patch);
    simplified.patch.hides_seams = patch.hides_seams;
    simplified.patch.crease_weight = patch.crease_weight;
    let simple = &simplified.patch;
    let share = share(budget, patch, simple);
    let mut coarse = Problem::new(simple, costs, problem.pace);
    let map = match start {
        Start::Map(corners) => Some(carried_map(patch, simple, corners)),
        Start::Nothing | Start::Layout(_) => None,
    };
    let start = map.as_deref().map_or(Start::Nothing, Start::Map);
    let layout = found(&mut coarse, &start, goal, share, report);
    problem.charge(coarse.work());
    Ok(Coarse {
        simplification,
        layout: layout?,
        simplified,
    })
}

/// The budget of a patch for as many steps on a simpler one.
fn share(budget: u64, patch: &Patch, simple: &Patch) -> u64 {
    budget / patch.areas.len() as u64 * simple.areas.len() as u64
}

/// The patch laid out along the cut of a simpler one.
fn carried(
    problem: &Problem,
    coarse: Coarse,
    goal: &Goal,
    report: &Report,
) -> Result<Layout, SolveError> {
    let Coarse {
        simplification,
        simplified,
        layout,
    } = coarse;
    let cut = simplification.carried(&layout.cut, &simplified.triangles);
    let layout = along(problem, cut, goal.bound)?;
    report(layout.energy, problem.length_of(&layout));
    Ok(layout)
}

/// The patch laid out along a cut that is straightened, and smoothed if it comes within the bound
/// with that; with neither where there is no layout otherwise.
fn along(problem: &Problem, cut: Cut, bound: f64) -> Result<Layout, SolveError> {
    let laid_out = |cut: Cut| {
        let mut layout = problem.flattened(cut, START)?;
        if problem.goes_on() {
            let _ = problem.settled(&mut layout, CARRIED, 0);
        }
        Ok(layout)
    };
    let patch = problem.patch;
    let is_marked = patch.forbidden.contains(&true);
    if !problem.goes_on() && !is_marked {
        return laid_out(cut);
    }
    // An edge of the simpler surface that is not forbidden may be carried to some that are.
    let straight = straightened_nearby(problem, &cut, bound);
    if !problem.goes_on() {
        return laid_out(straight).or_else(|_| laid_out(cut));
    }
    let is_enough = |layout: &Layout| is_about_within(layout, bound);
    let of_smooth = || laid_out(smoothed(problem, &straight, bound));
    // The smooth one misses the bound in about half of all cases; both are paid for in all, but for
    // large ones, that use all cores and much memory by themselves.
    let (smooth, straight) = if patch.areas.len() < HUGE {
        rayon::join(of_smooth, || laid_out(straight.clone()))
    } else {
        match of_smooth() {
            Ok(smooth) if is_enough(&smooth) => return Ok(smooth),
            smooth => (smooth, laid_out(straight)),
        }
    };
    match (smooth, straight) {
        (Ok(smooth), _) if is_enough(&smooth) => Ok(smooth),
        (Ok(smooth), Ok(straight)) if smooth.least_bound() < straight.least_bound() => Ok(smooth),
        (smooth, straight) => straight.or(smooth).or_else(|_| laid_out(cut)),
    }
}

/// Whether the bound is missed by little at most.
fn is_about_within(layout: &Layout, bound: f64) -> bool {
    layout.least_bound() <= bound + SLACK * (bound - 4.0)
}

/// A coordinate for every half-edge of a simpler surface: that of a patch's at the same vertex.
fn carried_map(patch: &Patch, simple: &Patch, corners: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut places = vec![[0.0; 2]; patch.topology.vertices()];
    for (h, &corner) in (0..).zip(corners) {
        places[patch.topology.origin(h) as usize] = corner;
    }
    (0..simple.topology.half_edges())
        .map(|h| places[simple.source[simple.topology.origin(h) as usize] as usize])
        .collect()
}

/// What cuts cost along the half-edges of a simpler surface: as much per length as on average
/// around the ends of an edge, along those edges that are not forbidden. Where all are, none is
/// allowed.
fn carried_costs(patch: &Patch, costs: &[f64], simple: &Patch) -> Vec<f64> {
    let mut sums = vec![[0.0; 2]; patch.topology.vertices()];
    let allowed = |&h: &u32| costs[h as usize].is_finite();
    for h in (0..patch.topology.half_edges()).filter(allowed) {
        for v in [patch.topology.origin(h), patch.topology.target(h)] {
            let sum = &mut sums[v as usize];
            sum[0] += costs[h as usize];
            sum[1] += patch.lengths[h as usize];
        }
    }
    let rate = |v: u32| {
        let [cost, length] = sums[simple.source[v as usize] as usize];
        if length > 0.0 {
            cost / length
        } else {
            f64::INFINITY
        }
    };
    (0..simple.topology.half_edges())
        .map(|h| {
            let ends = [simple.topology.origin(h), simple.topology.target(h)];
            let rate = 0.5 * (rate(ends[0]) + rate(ends[1]));
            // Where the length is 0, too.
            if rate.is_finite() {
                simple.lengths[h as usize] * rate
            } else {
                f64::INFINITY
            }
        })
        .collect()
}

/// The prices of seams on a simpler surface.
fn carried_prices(patch: &Patch, simple: &Patch) -> Vec<f64> {
    let carried = carried_costs(patch, &patch.prices, simple);
    let price = |(price, &length): (f64, &f64)| if price.is_finite() { price } else { length };
    carried
        .into_iter()
        .zip(&simple.lengths)
        .map(price)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fam_surface::shapes;

    const GOAL: Goal = Goal {
        bound: 4.1,
        seam_weight: 1.0,
        gives_up: false,
    };

    #[test]
    fn a_large_patch_is_cut_on_a_simpler_surface_and_laid_out_along_that_cut() {
        let patch = Patch::of(&shapes::torus(1.0, 0.4, 90, 36));
        let goes_on = || true;
        let mut problem = Problem::new(&patch, patch.lengths.clone(), &goes_on);
        let budget = 300 * patch.areas.len() as u64;
        let report = |_: f64, _: f64| true;
        let coarse = cheapest(&problem, &Start::Nothing, &GOAL, budget, &report);
        let coarse = coarse.unwrap().unwrap();
        assert!(coarse.simplified.patch.areas.len() < patch.areas.len() / 2);
        assert!(coarse.layout.suits(GOAL.bound));
        problem.injective = true;
        let layout = carried(&problem, coarse, &GOAL, &report).unwrap();
        assert!(problem.is_valid(&layout));
        assert_eq!(layout.uv.len(), layout.opened.topology.vertices());
        assert!(layout.energy < 4.2, "{}", layout.energy);
    }

    /// Among what is compared there are always the cuts without the map. With these torn bands, whose
    /// places have nothing to do with the shape, every search along the map ends with a longer one.
    #[test]
    fn a_map_that_misleads_makes_no_cut_longer() {
        let patch = Patch::of(&shapes::torus(1.0, 0.4, 90, 36));
        let goes_on = || true;
        let is_torn = |h: u32| {
            let ends = [patch.topology.origin(h), patch.topology.target(h)];
            let [p, q] = ends.map(|v| patch.positions[v as usize]);
            let [x, y, z]: [f64; 3] = std::array::from_fn(|k| 0.5 * (p[k] + q[k]));
            let (along, around) = (y.atan2(x), z.atan2(x.hypot(y) - patch.scale));
            (3.0 * along + 2.0 * around).sin().abs() < 0.2
        };
        let misled = |h: u32| patch.lengths[h as usize] * if is_torn(h) { 0.3 } else { 1.0 };
        let misled = (0..patch.topology.half_edges()).map(misled).collect();
        let budget = 300 * patch.areas.len() as u64;
        let map = vec![[0.0; 2]; 3 * patch.areas.len()];
        let length = |cost: Vec<f64>, start: &Start| {
            let problem = Problem::new(&patch, cost, &goes_on);
            let found = cheapest(&problem, start, &GOAL, budget, &|_, _| true);
            let found = found.unwrap().unwrap();
            assert!(found.layout.suits(GOAL.bound));
            found.layout.cut.cost(&found.simplified.patch.lengths)
        };
        let unguided = length(crease_costs(&patch), &Start::Nothing);
        assert!(length(misled, &Start::Map(&map)) <= unguided);
    }

    #[test]
    fn a_huge_patch_is_cut_by_way_of_a_middle_one() {
        let patch = Patch::of(&shapes::torus(1.0, 0.4, 220, 70));
        assert!(patch.areas.len() >= HUGE);
        let goes_on = || true;
        let mut problem = Problem::new(&patch, patch.lengths.clone(), &goes_on);
        let budget = 300 * patch.areas.len() as u64;
        let report = |_: f64, _: f64| true;
        let start = Start::Nothing;
        let layout = by_way_of_middle(&mut problem, &start, &GOAL, budget, &report);
        let layout = layout.unwrap().unwrap();
        problem.injective = true;
        assert!(problem.is_valid(&layout));
        assert!(layout.energy <= GOAL.bound + SLACK * (GOAL.bound - 4.0));
        // Most of the work is that on simpler surfaces.
        assert!(problem.work() < 60 * patch.areas.len() as u64);
    }

    #[test]
    fn prices_are_carried_to_simpler_surfaces() {
        let patch = Patch::of(&shapes::torus(1.0, 0.4, 90, 36));
        let simple = Simplification::new(&patch.topology, &patch.positions, 2_000);
        let simple = simple.simplified(patch.scale).patch;
        assert_eq!(carried_prices(&patch, &simple), simple.lengths);
        let middle =
            patch.positions.iter().map(|p| p[0]).sum::<f64>() / patch.positions.len() as f64;
        let is_dark: Vec<bool> = patch.positions.iter().map(|p| p[0] < middle).collect();
        let priced = patch.priced(|ends| {
            let rate = |v: u32| if is_dark[v as usize] { 0.1 } else { 1.0 };
            rate(ends[0]) + rate(ends[1])
        });
        let prices = carried_prices(&priced, &simple);
        let rate = |h: u32| prices[h as usize] / simple.lengths[h as usize];
        let far = |h: u32, sign: f64| {
            let ends = [simple.topology.origin(h), simple.topology.target(h)];
            ends.iter()
                .all(|&v| sign * (simple.positions[v as usize][0] - middle) > 0.1)
        };
        let close = |rate: f64, to: f64| (rate - to).abs() < 1e-9;
        for h in 0..simple.topology.half_edges() {
            assert!(!far(h, -1.0) || close(rate(h), 0.2), "{}", rate(h));
            assert!(!far(h, 1.0) || close(rate(h), 2.0), "{}", rate(h));
        }
    }

    #[test]
    fn small_patches_are_cut_as_they_are() {
        let patch = Patch::of(&shapes::torus(1.0, 0.4, 40, 20));
        let goes_on = || true;
        let problem = Problem::new(&patch, patch.lengths.clone(), &goes_on);
        let budget = 300 * patch.areas.len() as u64;
        let coarse = cheapest(&problem, &Start::Nothing, &GOAL, budget, &|_, _| true);
        assert!(coarse.unwrap().is_none());
    }

    /// The edges that do not exist on the simpler surface included.
    #[test]
    fn what_is_forbidden_is_so_on_a_simpler_surface() {
        let torus = shapes::torus(1.0, 0.4, 90, 36);
        let is_left = |v: u32| torus.positions()[v as usize][0] < 0.0;
        let patch = Patch::of(&torus).forbidding(|a, b| is_left(a) && is_left(b));
        let goes_on = || true;
        let cost = patch.without_forbidden(patch.lengths.clone());
        let problem = Problem::new(&patch, cost, &goes_on);
        let simple = Simplification::new(&patch.topology, &patch.positions, 2_000);
        let simple = simple.simplified(patch.scale).patch;
        let costs = carried_costs(&patch, &problem.cost, &simple);
        let mut has_free = vec![false; patch.topology.vertices()];
        for h in (0..patch.topology.half_edges()).filter(|&h| !patch.forbidden[h as usize]) {
            has_free[patch.topology.origin(h) as usize] = true;
        }
        let mut counts = [0; 2];
        for h in 0..simple.topology.half_edges() {
            let ends = [simple.topology.origin(h), simple.topology.target(h)];
            let is_free = ends
                .iter()
                .all(|&v| has_free[simple.source[v as usize] as usize]);
            let expected = if is_free {
                simple.lengths[h as usize]
            } else {
                f64::INFINITY
            };
            let cost = costs[h as usize];
            assert!(cost == expected || (cost / expected - 1.0).abs() < 1e-9);
            counts[usize::from(is_free)] += 1;
        }
        assert!(counts.iter().all(|&count| count > 100));
    }
}
