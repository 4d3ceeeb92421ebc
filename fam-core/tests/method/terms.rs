//! Loss terms that the caller adds.

use std::ops::ControlFlow;
use std::sync::Arc;

use burn::tensor::Tensor;
use fam_core::losses::{
    Evaluated, Isometry, Landmarks, LossTerm, Mips, Term, TermConfig, TermKind,
};
use fam_core::training::{Strategies, Trainer, TrainingConfig};
use fam_surface::{Surface, shapes};

use crate::training::{Cpu, small, term};

/// What a term comes to on a curved sheet, with a weight or only observed.
fn with_term(weight: f64, added: Arc<dyn LossTerm<Cpu>>) -> f32 {
    let config = TrainingConfig {
        starts: 1,
        ..small(120)
    };
    let surface = Surface::Mesh(shapes::draped_cloth(16, 12));
    let name = added.name();
    let device = Default::default();
    let trainer = Trainer::<Cpu>::with_strategies(config, &surface, &device, Strategies::tiled());
    let mut trainer = trainer.unwrap().with_term(weight, added);
    trainer.run(|_| ControlFlow::Continue(())).unwrap();
    let index = 0;
    let added = Term::Added {
        index,
        name,
        weight,
    };
    term(trainer.last_step().unwrap(), added)
}

#[test]
fn terms_that_are_added_are_minimised() {
    let cloth = shapes::draped_cloth(16, 12);
    let ends = [0, 16, cloth.positions().len() - 1];
    let ends = ends.map(|v| cloth.positions()[v]).to_vec();
    let uvs = vec![[1.0, 0.5], [0.5, 0.0], [0.0, 0.5]];
    // Weights, and the least that a term can come to.
    let terms: [(f64, f32, Arc<dyn LossTerm<Cpu>>); 3] = [
        (0.1, 1.98, Arc::new(Mips)),
        (0.1, 0.0, Arc::new(Isometry)),
        (1.0, 0.0, Arc::new(Landmarks::new(ends, uvs))),
    ];
    for (weight, least, term) in terms {
        let (with, without) = (
            with_term(weight, term.clone()),
            with_term(0.0, term.clone()),
        );
        assert!(
            with - least < 0.7 * (without - least),
            "{}: {with} {without}",
            term.name()
        );
    }
}

/// One that is named in a configuration is the same.
#[test]
fn terms_of_a_configuration_are_those_of_the_caller() {
    let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 16, 8));
    let config = small(3);
    let named = TrainingConfig {
        terms: vec![TermConfig {
            weight: 0.1,
            kind: TermKind::Mips,
        }],
        ..config.clone()
    };
    let device = Default::default();
    let mut by_name = Trainer::<Cpu>::new(named, &surface, &device).unwrap();
    let mut by_caller = Trainer::<Cpu>::new(config.clone(), &surface, &device)
        .unwrap()
        .with_term(0.1, Arc::new(Mips));
    let mut without = Trainer::<Cpu>::new(config, &surface, &device).unwrap();
    for _ in 0..3 {
        assert_eq!(by_name.step().unwrap(), by_caller.step().unwrap());
        without.step().unwrap();
    }
    assert_ne!(by_name.step().unwrap().total, without.step().unwrap().total);
}

/// A term that is no number ends training with its own name.
#[test]
fn a_term_that_breaks_down_is_named() {
    struct Broken;
    impl LossTerm<Cpu> for Broken {
        fn name(&self) -> &'static str {
            "broken"
        }
        fn loss(&self, evaluated: &Evaluated<'_, Cpu>) -> Option<Tensor<Cpu, 1>> {
            let q = evaluated.unwrap.as_ref()?.q.clone();
            Some(q.mean() * f32::NAN)
        }
    }
    let surface = Surface::Mesh(shapes::torus(1.0, 0.4, 16, 8));
    let trainer = Trainer::<Cpu>::new(small(3), &surface, &Default::default()).unwrap();
    let error = trainer.with_term(1.0, Arc::new(Broken)).step().unwrap_err();
    assert!(
        error.to_string().contains("term broken became NaN"),
        "{error}"
    );
}
