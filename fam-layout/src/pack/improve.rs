//! The largest scale at which pieces fit, and the plan by which they do.

use fam_surface::random::Random;
use rayon::prelude::*;

use super::hull::EnclosingBox;
use super::occupancy::Shape;
use super::options::PackError;
use super::piece::Piece;
use super::search::{Board, Fit, Plan, Stages};
use super::sheet::Sheet;

/// So many charts are tried in more than one order.
const FEW: usize = 256;

/// The scale is searched to this factor.
const SCALE_ACCURACY: f64 = 1.0025;

/// By how much more than its free rows tell a scale may grow.
const SLACK: f64 = 1.02;

/// The factor by which a scale is smaller than the one at which charts should just fit, so that
/// they nearly always do; and where it is not known by how much they do not fit.
const NEARLY: f64 = 0.996;
const SMALLER: f64 = 0.85;

/// How often it is told by how much charts do not fit; beyond that it is of no use, as where charts
/// that stay leave no room.
const TRIES: usize = 12;

/// A scale is given up that is smaller by this factor than one at which charts cover all.
const HOPELESS: f64 = 1e-4;

/// Plans that are tried at once, each a change of the best.
const BATCH: usize = 8;

/// The factor by which the scale grows at least once all pieces fit.
const GROWTH: f64 = 1.002;

/// Pieces that are to become as large as possible.
pub struct Task<'a, S> {
    /// The pieces.
    pub pieces: &'a [Piece],
    /// The number of tiles.
    pub tiles: usize,
    /// What is taken in each tile from the start.
    pub taken: Vec<Shape>,
    /// How tiles and pieces look at a scale.
    pub sheet: S,
    /// In how many steps, at most, the scale is searched at which pieces fit by a given plan.
    pub steps: usize,
    /// How many rounds of local search there are.
    pub rounds: usize,
}

/// A plan that all pieces fit by, and the scale at which they do.
pub struct Best {
    /// The scale.
    pub scale: f64,
    /// The plan.
    pub plan: Plan,
    /// How the pieces lie.
    pub fit: Fit,
}

impl<S: Fn(f64) -> Sheet + Sync> Task<'_, S> {
    /// The largest scale found at which all pieces fit, but no larger than `most`, and that at
    /// which they fit by some plans is looked for from `start` on.
    ///
    /// # Errors
    /// There is no room, however small they become.
    pub fn run(
        &self,
        plans: &[Plan],
        start: f64,
        most: f64,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Best, PackError> {
        let best = self.first(plans, start, most, goes_on)?;
        Ok(match self.rounds {
            0 => best,
            _ => self.improved(best, most, goes_on),
        })
    }

    /// The best of some plans at a scale, and how pieces lie by it.
    pub fn best_of(&self, scale: f64, plans: &[Plan]) -> Option<(Plan, Fit)> {
        let board = self.board(scale);
        let fits: Vec<Option<Fit>> = plans.par_iter().map(|plan| board.fit(plan)).collect();
        let fits = plans
            .iter()
            .zip(fits)
            .filter_map(|(plan, fit)| Some((plan, fit?)));
        let (plan, fit) = fits.min_by_key(|(_, fit)| fit.score())?;
        Some((plan.clone(), fit))
    }

    fn board(&self, scale: f64) -> Board<'_> {
        Board::new(self.pieces, (self.sheet)(scale), self.tiles, &self.taken)
    }

    /// The largest scale found at which pieces fit by one of some plans: each step divides into three
    /// what is between one that is small enough and one that is too large.
    fn first(
        &self,
        plans: &[Plan],
        start: f64,
        most: f64,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Best, PackError> {
        let rows = |scale: f64| (self.tiles * (self.sheet)(scale).columns) as f64;
        let (mut scale, mut high) = (start.min(most), most);
        let mut tries = 0;
        let mut best = loop {
            match self.best_of(scale, plans) {
                Some((plan, fit)) if fit.height as f64 <= rows(scale) => {
                    break Best { scale, plan, fit };
                }
                Some((_, fit)) if tries < TRIES => {
                    high = scale;
                    scale *= NEARLY * (rows(scale) / fit.height as f64).sqrt();
                    tries += 1;
                }
                _ => {
                    high = scale;
                    scale *= SMALLER;
                }
            }
            if scale < HOPELESS * most {
                return Err(PackError::NoRoom);
            }
        };
        for _ in 0..self.steps {
            if !goes_on() {
                break;
            }
            // The free rows tell how much denser it can become.
            let free = rows(best.scale) / best.fit.height.max(1) as f64;
            let denser = high.min(best.scale * SLACK * free.sqrt());
            let low = (best.scale * denser).sqrt();
            if low <= SCALE_ACCURACY * best.scale {
                break;
            }
            // Two at a time, since one fit is the work of one thread.
            let scales = [low, (low * denser).sqrt()];
            let fits: Vec<Option<Best>> = scales
                .into_par_iter()
                .map(|scale| {
                    let (plan, fit) = self.best_of(scale, plans)?;
                    (fit.height as f64 <= rows(scale)).then_some(Best { scale, plan, fit })
                })
                .collect();
            let fitting = fits.iter().rposition(Option::is_some).map_or(0, |k| k + 1);
            high = scales.get(fitting).copied().unwrap_or(high);
            best = fits.into_iter().flatten().last().unwrap_or(best);
        }
        Ok(best)
    }

    /// What a local search finds: plans are changed a little, again and again, at a scale that is a
    /// little too large, until all fit.
    fn improved(&self, mut best: Best, most: f64, goes_on: &(dyn Fn() -> bool + Sync)) -> Best {
        let mut scale = (GROWTH * best.scale).min(most);
        let mut board = self.board(scale);
        let Some(mut found) = board.stages(&best.plan) else {
            return best;
        };
        for round in 0..self.rounds {
            while found.fit.height <= board.rows() {
                let rows = board.rows() as f64;
                let denser = scale * (rows / found.fit.height.max(1) as f64).sqrt();
                best = Best {
                    scale,
                    plan: found.plan.clone(),
                    fit: found.fit.clone(),
                };
                if scale >= most {
                    return best;
                }
                scale = (GROWTH * scale).max(denser).min(most);
                board = self.board(scale);
                match board.stages(&best.plan) {
                    Some(next) => found = next,
                    None => return best,
                }
            }
            if !goes_on() {
                break;
            }
            let candidates: Vec<Option<(Plan, Fit)>> = (0..BATCH)
                .into_par_iter()
                .map(|k| {
                    let mut random = Random::new((round * BATCH + k) as u64);
                    let plan = changed(&found, &board, &mut random);
                    let fit = board.other(&found, &plan)?;
                    Some((plan, fit))
                })
                .collect();
            let candidates = candidates.into_iter().flatten();
            if let Some((plan, _)) = candidates.min_by_key(|(_, fit)| fit.score()) {
                match board.stages(&plan) {
                    Some(next) => found = next,
                    None => return best,
                }
            }
        }
        if found.fit.height <= board.rows() {
            let Stages { plan, fit, .. } = found;
            best = Best { scale, plan, fit };
        }
        best
    }
}

/// Plans by which the largest pieces come first, by one measure or another.
pub fn plans(pieces: &[Piece]) -> Vec<Plan> {
    let by = |measure: fn(&EnclosingBox) -> f64| {
        let measure = |i: usize| measure(&pieces[i].boxes[0]);
        let mut order: Vec<usize> = (0..pieces.len()).collect();
        order.sort_by(|&i, &j| measure(j).total_cmp(&measure(i)));
        Plan {
            order,
            angles: vec![None; pieces.len()],
        }
    };
    let mut plans = vec![by(|found| found.size[0] * found.size[1])];
    if pieces.len() <= FEW {
        plans.push(by(|found| found.size[0] + found.size[1]));
    }
    plans
}

/// A plan that differs a little: a piece comes earlier, two change places, or one lies otherwise.
fn changed(found: &Stages, board: &Board<'_>, random: &mut Random) -> Plan {
    let mut plan = found.plan.clone();
    let count = plan.order.len();
    for _ in 0..1 + random.below(3) {
        match random.below(4) {
            0 => {
                let from = match random.below(2) {
                    0 => plan
                        .order
                        .iter()
                        .position(|&i| i == found.fit.highest)
                        .unwrap_or(0),
                    _ => random.below(count),
                };
                let to = random.below(from + 1);
                plan.order[to..=from].rotate_right(1);
            }
            1 => {
                let from = random.below(count);
                let to = random.below(count);
                let piece = plan.order.remove(from);
                plan.order.insert(to, piece);
            }
            2 => plan.order.swap(random.below(count), random.below(count)),
            _ => {
                let piece = random.below(count);
                let angle = random.below(board.angles(piece) + board.angles(piece) / 2 + 1);
                plan.angles[piece] = (angle < board.angles(piece)).then_some(angle);
            }
        }
    }
    plan
}
