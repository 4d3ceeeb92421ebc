//! Training that is interrupted, and training that breaks down.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use burn::tensor::Tensor;
use fam_core::losses::{Evaluated, LossTerm};
use fam_core::networks::FlattenAnythingConfig;
use fam_core::sampling::Sampling;
use fam_core::training::{OptimizerKind, Step, Strategies, Trainer, TrainingConfig};
use fam_surface::{Surface, shapes};

use crate::training::{Cpu, small};

/// The weights of a trained map, as bytes.
fn finished(trainer: Trainer<Cpu>, surface: &Surface) -> Vec<u8> {
    let (map, outcome) = trainer.finish(surface);
    outcome.unwrap();
    map.to_safetensors().unwrap()
}

/// Wherever it is interrupted: while starts open the surface, while the best two go on, and later.
#[test]
fn training_goes_on_from_a_checkpoint_as_if_it_had_not_been_interrupted() {
    let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 24, 12));
    for (optimizer, starts) in [(OptimizerKind::Soap, 3), (OptimizerKind::AdamW, 1)] {
        let config = TrainingConfig {
            optimizer,
            starts,
            sampling: Sampling::Vertices,
            networks: FlattenAnythingConfig::new().with_width(32).with_latent(8),
            points: 120,
            ..small(40)
        };
        let fresh = || {
            let device = Default::default();
            let strategies = Strategies::tiled();
            Trainer::<Cpu>::with_strategies(config.clone(), &surface, &device, strategies).unwrap()
        };
        let mut whole = fresh();
        let mut steps = Vec::new();
        let observe = |step: &Step| {
            steps.push(step.clone());
            ControlFlow::Continue(())
        };
        whole.run(observe).unwrap();
        let expected = finished(whole, &surface);
        let last = steps.len() - 1;
        for stop in [0, 7, 17, 20, 29, 35, last] {
            let mut checkpoint = Vec::new();
            let mut observed = 0;
            let mut first = fresh();
            first
                .run_observed(|trainer, _| {
                    observed += 1;
                    if observed == stop + 1 {
                        checkpoint = trainer.checkpoint().unwrap();
                        return ControlFlow::Break(());
                    }
                    ControlFlow::Continue(())
                })
                .unwrap();
            let mut second = fresh().resumed(&checkpoint).unwrap();
            let mut rest = Vec::new();
            let observe = |step: &Step| {
                rest.push(step.clone());
                ControlFlow::Continue(())
            };
            second.run(observe).unwrap();
            assert_eq!(rest, steps[stop + 1..], "{optimizer:?} after {stop}");
            assert!(
                finished(second, &surface) == expected,
                "{optimizer:?} after {stop}"
            );
        }
    }
}

#[test]
fn a_checkpoint_of_something_else_is_refused() {
    let torus = Surface::Mesh(shapes::torus(1.0, 0.4, 24, 12));
    let device = Default::default();
    let fresh = |config, surface: &Surface| Trainer::<Cpu>::new(config, surface, &device).unwrap();
    let mut trainer = fresh(small(60), &torus);
    trainer.step().unwrap();
    let bytes = trainer.checkpoint().unwrap();
    let refused = |config, surface: &Surface, bytes: &[u8]| {
        let resumed = fresh(config, surface).resumed(bytes);
        resumed.err().unwrap().to_string()
    };
    let other = Surface::Mesh(shapes::torus(1.0, 0.3, 24, 12));
    assert!(refused(small(60), &other, &bytes).contains("another surface"));
    assert!(refused(small(61), &torus, &bytes).contains("another configuration"));
    let model = finished(fresh(small(60), &torus), &torus);
    assert!(refused(small(60), &torus, &model).contains("no checkpoint"));
    for length in [0, 7, 1000, bytes.len() - 1] {
        refused(small(60), &torus, &bytes[..length]);
    }
}

/// A term that is not finite as often as it says, from an iteration on.
struct Breaking {
    times: AtomicUsize,
}

impl LossTerm<Cpu> for Breaking {
    fn name(&self) -> &'static str {
        "breaking"
    }

    fn loss(&self, evaluated: &Evaluated<'_, Cpu>) -> Option<Tensor<Cpu, 1>> {
        let q = evaluated.unwrap.as_ref()?.q.clone();
        let breaks = evaluated.iteration == 70
            && self
                .times
                .fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1))
                .is_ok();
        Some(q.mean() * if breaks { f32::NAN } else { 0.0 })
    }
}

#[test]
fn training_that_breaks_down_goes_back_three_times_at_most() {
    let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 24, 12));
    let config = TrainingConfig {
        starts: 1,
        ..small(80)
    };
    for (times, expected_steps) in [(0, 80), (1, 100), (3, 140), (4, 130)] {
        let trainer = Trainer::<Cpu>::new(config.clone(), &surface, &Default::default()).unwrap();
        let term = Breaking {
            times: times.into(),
        };
        let mut trainer = trainer.with_term(1.0, Arc::new(term));
        let mut steps = 0;
        let outcome = trainer.run(|_| {
            steps += 1;
            ControlFlow::Continue(())
        });
        assert_eq!(steps, expected_steps, "{times}");
        assert_eq!(outcome.is_err(), times > 3);
    }
}

/// Also where the weights that it goes back to are older than the checkpoint.
#[test]
fn training_that_goes_on_breaks_down_as_if_it_had_not_been_interrupted() {
    let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 24, 12));
    let config = TrainingConfig {
        points: 200,
        ..small(80)
    };
    let fresh = |times: usize| {
        let term = Breaking {
            times: times.into(),
        };
        let trainer = Trainer::<Cpu>::new(config.clone(), &surface, &Default::default());
        trainer.unwrap().with_term(1.0, Arc::new(term))
    };
    let mut whole = fresh(1);
    whole.run(|_| ControlFlow::Continue(())).unwrap();
    let mut checkpoint = Vec::new();
    let mut first = fresh(1);
    let is_there = |step: &Step, trainer: &Trainer<Cpu>| {
        step.iteration == 60 && trainer.last_step() == Some(step) && step.before > 100
    };
    first
        .run_observed(|trainer, step| match is_there(step, trainer) {
            true => {
                checkpoint = trainer.checkpoint().unwrap();
                ControlFlow::Break(())
            }
            false => ControlFlow::Continue(()),
        })
        .unwrap();
    let mut second = fresh(1).resumed(&checkpoint).unwrap();
    second.run(|_| ControlFlow::Continue(())).unwrap();
    assert!(finished(second, &surface) == finished(whole, &surface));
    // Without the term it is another training.
    let other = Trainer::<Cpu>::new(config.clone(), &surface, &Default::default()).unwrap();
    let refused = other.resumed(&checkpoint).err().unwrap();
    assert!(refused.to_string().contains("another configuration"));
}

/// A trainer that was broken off goes on, and is saved, as it is.
#[test]
fn a_trainer_can_be_run_in_pieces() {
    let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 24, 12));
    let fresh = || Trainer::<Cpu>::new(small(20), &surface, &Default::default()).unwrap();
    let mut whole = fresh();
    whole.run(|_| ControlFlow::Continue(())).unwrap();
    let mut pieces = fresh();
    for piece in 0..100 {
        let mut left = 7;
        let mut is_over = true;
        let observe = |_: &Step| {
            left -= 1;
            is_over = left > 0;
            match is_over {
                true => ControlFlow::Continue(()),
                false => ControlFlow::Break(()),
            }
        };
        pieces.run(observe).unwrap();
        if is_over {
            break;
        }
        if piece == 2 {
            let checkpoint = pieces.checkpoint().unwrap();
            pieces = fresh().resumed(&checkpoint).unwrap();
        }
    }
    assert!(finished(pieces, &surface) == finished(whole, &surface));
}
