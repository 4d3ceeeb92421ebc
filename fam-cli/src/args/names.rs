//! What options may be set to.

use clap::ValueEnum;
use fam::{FinishMode, Method};
use fam_core::jacobian::JacobianMode;
use fam_core::losses::Objective;
use fam_core::sampling::Sampling;
use fam_core::training::Ablation;
use fam_io::Format;
use fam_layout::{Stack, Turns};
use fam_surface::metrics::engine::Purpose;
use fam_surface::seams::SeamRule;
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
pub enum Preset {
    Fast,
    Paper,
}

/// What computes.
#[expect(
    missing_docs,
    reason = "comments would be shown as the help of the values"
)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
pub enum BackendName {
    Auto,
    Flex,
    Ndarray,
    Wgpu,
    Cuda,
}

/// How the command line calls a value.
pub fn name_of(value: impl ValueEnum) -> String {
    let value = value.to_possible_value();
    value.map_or(String::new(), |value| value.get_name().to_string())
}

/// Command-line names for a type of the library.
macro_rules! names {
    ($name:ident for $of:ident { $($variant:ident),+ }) => {
        #[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
        pub enum $name { $($variant),+ }

        impl From<$name> for $of {
            fn from(name: $name) -> Self {
                match name { $($name::$variant => $of::$variant),+ }
            }
        }
    };
}

names!(FormatName for Format { Glb, Gltf, Obj, Off, Ply, Xyz });
names!(JacobianName for JacobianMode { DoubleBackward, ForwardTangent });
names!(ObjectiveName for Objective { Paper, Reference });
names!(SamplingName for Sampling { PoissonDisk, Vertices });
names!(Part for Ablation { DeformBranch, UnwrapBranch, CutNet });
names!(FinishName for FinishMode { Full, None });
names!(MethodName for Method { Auto, Direct, Neural });
names!(TurnsName for Turns { Free, Quarters, None });
names!(PurposeName for Purpose { Lightmap, Texture });
names!(StackName for Stack { None, Identical, Mirrored });
names!(SeamRuleName for SeamRule { Spacing, Paper });
