use super::patchwork::Patchwork;

/// Most edges around a hole that is closed; a longer loop is taken for a boundary.
const LONGEST_LOOP: usize = 12;

/// Fills the holes that a few edges surround.
pub(super) fn close(patchwork: &mut Patchwork) {
    for v in 0..patchwork.points() {
        for end in patchwork.boundary_at(v) {
            if v < end
                && let Some(around) = hole(patchwork, v, end)
            {
                fill(patchwork, around);
            }
        }
    }
}

/// The loop along the gaps beside a boundary edge, if it is short.
fn hole(patchwork: &Patchwork, start: u32, second: u32) -> Option<Vec<u32>> {
    let mut around = vec![start, second];
    while around.len() <= LONGEST_LOOP + 1 {
        let [.., from, v] = around[..] else {
            return None;
        };
        let to = patchwork.across_gap(from, v)?;
        if (v, to) == (start, second) {
            around.truncate(around.len() - 1);
            return Some(around);
        }
        around.push(to);
    }
    None
}

/// Cuts the smallest ears that fit off a polygon, until nothing is left of it; if that cannot
/// be, it stays as it is.
fn fill(patchwork: &mut Patchwork, mut around: Vec<u32>) {
    let before = patchwork.triangles().len();
    while around.len() >= 3 {
        let n = around.len();
        let ear = |i: usize| [around[(i + n - 1) % n], around[i], around[(i + 1) % n]];
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&i, &j| {
            let [i, j] = [i, j].map(|i| patchwork.perimeter(ear(i)));
            i.total_cmp(&j)
        });
        let cut = order.into_iter().find(|&i| patchwork.add_if_fits(ear(i)));
        match cut {
            Some(_) if n == 3 => return,
            Some(i) => around.remove(i),
            None => return patchwork.truncate(before),
        };
    }
}
