use burn::config::Config;
use burn::module::Module;
use burn::tensor::backend::Backend;
use rand::SeedableRng;
use rand_pcg::Pcg64;

use super::{CutNet, DeformNet, Mlp, UnwrapNet, WrapNet};

/// Sixteen times the paper's; memory grows with its square.
const MAX_WIDTH: usize = 8_192;

/// Widths of the sub-networks; the defaults are the paper's.
#[derive(Config, Debug, PartialEq)]
pub struct FlattenAnythingConfig {
    /// Channels of every hidden layer.
    #[config(default = 512)]
    pub width: usize,
    /// Times as many of them in Cut-Net and Unwrap-Net, which UVs come from; once if it is not given.
    pub unwrap_factor: Option<usize>,
    /// Channels h between ξ′ and ξ″.
    #[config(default = 64)]
    pub latent: usize,
}

/// The Flatten Anything Model: the four sub-networks, shared by both cycles.
#[derive(Module, Debug)]
pub struct FlattenAnything<B: Backend> {
    /// Deform-Net.
    pub deform: DeformNet<B>,
    /// Wrap-Net.
    pub wrap: WrapNet<B>,
    /// Cut-Net.
    pub cut: CutNet<B>,
    /// Unwrap-Net.
    pub unwrap: UnwrapNet<B>,
}

impl<B: Backend> FlattenAnything<B> {
    /// The widths of the sub-networks.
    pub(crate) fn config(&self) -> FlattenAnythingConfig {
        let outputs = |mlp: &Mlp<B>, layer: usize| mlp.layers[layer].weight.dims()[1];
        let width = outputs(&self.deform.mlp_1, 0);
        FlattenAnythingConfig::new()
            .with_width(width)
            .with_unwrap_factor(Some(outputs(&self.unwrap.mlp, 0) / width))
            .with_latent(outputs(&self.deform.mlp_1, 3))
    }
}

impl FlattenAnythingConfig {
    /// Whether all widths lie in 1 to [`MAX_WIDTH`].
    pub(crate) fn is_possible(&self) -> bool {
        let widths = [self.width, self.unwrap_width(), self.latent];
        widths.iter().all(|width| (1..=MAX_WIDTH).contains(width))
    }

    /// Channels of the hidden layers of Cut-Net and Unwrap-Net.
    pub fn unwrap_width(&self) -> usize {
        self.width.saturating_mul(self.unwrap_factor.unwrap_or(1))
    }

    /// Networks with fresh weights: one seed gives the same weights on every backend.
    pub fn init<B: Backend>(&self, device: &B::Device, seed: u64) -> FlattenAnything<B> {
        let (w, h) = (self.width, self.latent);
        let u = self.unwrap_width();
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut mlp = |channels: &[usize]| Mlp::init(channels, device, &mut rng);
        FlattenAnything {
            deform: DeformNet {
                mlp_1: mlp(&[2, w, w, w, h]),
                mlp_2: mlp(&[2 + h, w, w, w, 2]),
            },
            wrap: WrapNet {
                mlp_1: mlp(&[2, w, w, w, h]),
                mlp_2: mlp(&[2 + h, w, w, w, 6]),
            },
            cut: CutNet {
                mlp_1: mlp(&[3, u, u, h]),
                mlp_2: mlp(&[3 + h, u, u, 3]),
            },
            unwrap: UnwrapNet {
                mlp: mlp(&[3, u, u, 2]),
            },
        }
    }
}
