//! A term of one's own in the objective: the vertical of the surface becomes the vertical of the UVs.
//! `cargo run --release -p fam-core --example own_term`.

use std::error::Error;
use std::ops::ControlFlow;
use std::sync::Arc;

use burn::tensor::{Tensor, backend::Backend};
use burn_autodiff::Autodiff;
use burn_flex::Flex;
use fam_core::losses::{Evaluated, LossTerm};
use fam_core::training::{Strategies, Trainer, TrainingConfig};
use fam_surface::{Surface, shapes};

/// 1 − the correlation of v with z, in 0 … 2.
struct Upright;

impl<B: Backend> LossTerm<B> for Upright {
    fn name(&self) -> &'static str {
        "upright"
    }

    fn loss(&self, evaluated: &Evaluated<'_, B>) -> Option<Tensor<B, 1>> {
        let centred = |x: Tensor<B, 2>| x.clone() - x.mean_dim(0);
        let v = centred(evaluated.unwrap.as_ref()?.q.clone().narrow(1, 1, 1));
        let z = centred(evaluated.points.clone().narrow(1, 2, 1));
        let dot = |a: &Tensor<B, 2>, b: &Tensor<B, 2>| (a.clone() * b.clone()).sum();
        let lengths = (dot(&v, &v) * dot(&z, &z)).clamp_min(1e-12).sqrt();
        Some(dot(&v, &z) / lengths * -1.0 + 1.0)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let surface = Surface::Mesh(shapes::open_cylinder(0.5, 1.5, 40, 20));
    let config = TrainingConfig {
        iterations: 150,
        starts: 2,
        ..TrainingConfig::fast()
    };
    let mut upright = Vec::new();
    for weight in [0.0, 0.1] {
        let device = Default::default();
        let strategies = Strategies::tiled();
        let trainer = Trainer::<Autodiff<Flex>>::with_strategies(
            config.clone(),
            &surface,
            &device,
            strategies,
        )?;
        let mut trainer = trainer.with_term(weight, Arc::new(Upright));
        trainer.run(|_| ControlFlow::Continue(()))?;
        let last = trainer.last_step().ok_or("no step was made")?;
        let terms = last
            .terms
            .iter()
            .map(|(term, value)| format!("{} {value:.3}", term.name()));
        println!("weight {weight}: {}", terms.collect::<Vec<_>>().join(", "));
        upright.extend(last.terms.last().map(|(_, value)| *value));
    }
    match upright[1] < upright[0] {
        true => Ok(()),
        false => Err("the term was not minimised".into()),
    }
}
