use super::edges::Side;
use super::layout::Layout;

/// The connected pieces of a layout: triangles joined across the mesh edges at both ends
/// of which their UV coordinates are equal.
///
/// Disjoint sets, with the winding of each triangle relative to its parent.
pub(super) struct Charts {
    parents: Vec<u32>,
    sizes: Vec<u32>,
    opposed: Vec<bool>,
}

impl Charts {
    pub(super) fn new(triangles: usize, sides: &[Side]) -> Self {
        let mut charts = Self {
            parents: (0..triangles as u32).collect(),
            sizes: vec![1; triangles],
            opposed: vec![false; triangles],
        };
        for joined in sides.chunk_by(|a, b| (a.edge, a.uvs) == (b.edge, b.uvs)) {
            for pair in joined.windows(2) {
                // Neighbours of the same winding run along their edge in opposite directions.
                charts.join(
                    pair[0].triangle,
                    pair[1].triangle,
                    pair[0].reversed == pair[1].reversed,
                );
            }
        }
        charts
    }

    /// How many charts there are, without those made of degenerate triangles only.
    pub(super) fn count(&self, layout: &Layout) -> usize {
        let mut counted = vec![false; self.parents.len()];
        for t in layout.measured() {
            counted[self.find(t as u32).0] = true;
        }
        counted.iter().filter(|&&chart| chart).count()
    }

    /// The chart of a triangle, named by one of its triangles, and whether the windings of
    /// the two oppose each other.
    pub(super) fn find(&self, triangle: u32) -> (usize, bool) {
        let (mut at, mut opposed) = (triangle as usize, false);
        while self.parents[at] as usize != at {
            opposed ^= self.opposed[at];
            at = self.parents[at] as usize;
        }
        (at, opposed)
    }

    fn join(&mut self, a: u32, b: u32, opposed: bool) {
        let ((a, a_opposed), (b, b_opposed)) = (self.find(a), self.find(b));
        if a == b {
            return;
        }
        let (small, large) = if self.sizes[a] < self.sizes[b] {
            (a, b)
        } else {
            (b, a)
        };
        self.parents[small] = large as u32;
        self.sizes[large] += self.sizes[small];
        self.opposed[small] = opposed ^ a_opposed ^ b_opposed;
    }
}
