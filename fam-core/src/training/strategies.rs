use std::sync::Arc;

use burn::tensor::backend::Backend;

#[cfg(feature = "cube")]
use crate::evaluation::Blocked;
use crate::evaluation::{Evaluation, Plain, Tiled};
#[cfg(feature = "cube")]
use crate::neighbors::BruteForce;
use crate::neighbors::{KdTree, NeighborSearch};

/// Steps between two readings on a graphics device: at the paper's configuration, the host then
/// waits a few times a second.
#[cfg(feature = "cube")]
const READ_EVERY: usize = 16;

/// What backends do each in its own way, with the same results.
#[derive(Clone)]
pub struct Strategies<B: Backend> {
    /// How the networks are computed.
    pub evaluation: Arc<dyn Evaluation<B>>,
    /// Where nearest neighbours come from.
    pub search: Arc<dyn NeighborSearch<B>>,
    /// Of how many steps one has its losses read, at least 1: whoever reads waits for the device.
    pub read_every: usize,
}

impl<B: Backend> Strategies<B> {
    /// Burn's operations and a k-d tree on the host, which any backend can do.
    pub fn plain() -> Self {
        Self {
            evaluation: Arc::new(Plain),
            search: Arc::new(KdTree),
            read_every: 1,
        }
    }

    /// Sub-networks in tiles and a k-d tree, for backends that compute on the host.
    pub fn tiled() -> Self
    where
        Tiled: Evaluation<B>,
    {
        Self {
            evaluation: Arc::new(Tiled::default()),
            ..Self::plain()
        }
    }

    /// Sub-networks in blocks and neighbours found on the device, and in most steps no word from there
    /// of the losses, for backends that compile kernels by CubeCL.
    #[cfg(feature = "cube")]
    pub fn on_device() -> Self
    where
        BruteForce: NeighborSearch<B>,
    {
        Self {
            evaluation: Arc::new(Blocked),
            search: Arc::new(BruteForce),
            read_every: READ_EVERY,
        }
    }
}
