//! Disjoint sets.

/// Disjoint sets of numbers, each with its lowest as the root.
pub struct Sets {
    parents: Vec<u32>,
}

impl Sets {
    /// Every number below `count` by itself.
    pub fn new(count: usize) -> Self {
        Self {
            parents: (0..count as u32).collect(),
        }
    }

    /// Makes one of the sets of two numbers.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parents[a.max(b) as usize] = a.min(b);
    }

    /// The root of a number. Halves the path to it for later searches.
    pub fn root(&mut self, mut of: u32) -> u32 {
        while self.parents[of as usize] != of {
            let parent = self.parents[of as usize];
            self.parents[of as usize] = self.parents[parent as usize];
            of = parent;
        }
        of
    }

    /// Makes every number a child of its root, for [`find`](Self::find).
    pub fn settle(&mut self) {
        // A parent is never higher than its child, so it is settled first.
        for number in 0..self.parents.len() {
            self.parents[number] = self.parents[self.parents[number] as usize];
        }
    }

    /// The root of a number, after [`settle`](Self::settle).
    pub fn find(&self, of: u32) -> u32 {
        self.parents[of as usize]
    }
}
