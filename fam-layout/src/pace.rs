//! What long computations ask before they go on, and what they tell of their work.

/// Whoever waits for a computation.
pub trait Pace: Sync {
    /// Whether to look for something better still; asked often, from any thread.
    fn goes_on(&self) -> bool;

    /// A Newton step over so many triangles was taken.
    fn works(&self, triangles: usize);
}

/// What is only asked.
impl<F: Fn() -> bool + Sync> Pace for F {
    fn goes_on(&self) -> bool {
        self()
    }

    fn works(&self, _: usize) {}
}
