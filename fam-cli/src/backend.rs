//! The concrete backends: which are compiled in, which is chosen, and calling into one.

use burn::tensor::backend::AutodiffBackend;
use burn_autodiff::Autodiff;
use fam_core::training::Strategies;

use crate::args::BackendName;
#[cfg(not(all(
    feature = "flex",
    feature = "ndarray",
    feature = "wgpu",
    feature = "cuda"
)))]
use crate::args::name_of;
use crate::failure::Failure;

#[cfg(not(any(
    feature = "flex",
    feature = "ndarray",
    feature = "wgpu",
    feature = "cuda"
)))]
compile_error!("fam needs at least one backend: enable the feature flex, ndarray, wgpu or cuda");

/// A backend to compute on.
#[derive(Debug, Clone)]
pub enum Backend {
    /// The CPU, by burn-flex.
    #[cfg(feature = "flex")]
    Flex,
    /// The CPU, by burn-ndarray.
    #[cfg(feature = "ndarray")]
    Ndarray,
    /// A graphics adapter, by burn-wgpu.
    #[cfg(feature = "wgpu")]
    Wgpu {
        /// The adapter, as Burn counts them.
        device: burn_wgpu::WgpuDevice,
        /// Its name.
        adapter: String,
    },
    /// A GPU of NVIDIA's, by burn-cuda.
    #[cfg(feature = "cuda")]
    Cuda,
}

/// A computation that runs on any backend.
pub trait Job {
    /// What it comes to.
    type Output;

    /// Runs on a device; what trains there takes these strategies.
    fn run<B: AutodiffBackend>(self, device: &B::Device, strategies: Strategies<B>)
    -> Self::Output;
}

impl Backend {
    /// The backend that the user's choice stands for.
    ///
    /// # Errors
    /// It is not compiled in, or finds no device.
    pub fn choose(name: BackendName) -> Result<Self, Failure> {
        match name {
            BackendName::Auto => auto(),
            #[cfg(feature = "flex")]
            BackendName::Flex => Ok(Self::Flex),
            #[cfg(feature = "ndarray")]
            BackendName::Ndarray => Ok(Self::Ndarray),
            #[cfg(feature = "wgpu")]
            BackendName::Wgpu => adapters::best(|_| true).ok_or_else(|| {
                Failure::input(
                    "wgpu finds no graphics adapter; the backend auto takes the CPU then",
                )
            }),
            #[cfg(feature = "cuda")]
            BackendName::Cuda => cuda().ok_or_else(|| {
                Failure::input("CUDA finds no device; the backend auto takes another then")
            }),
            #[cfg(not(all(
                feature = "flex",
                feature = "ndarray",
                feature = "wgpu",
                feature = "cuda"
            )))]
            missing => Err(Failure::input(format!(
                "the backend {} is not compiled in",
                name_of(missing)
            ))),
        }
    }

    /// Runs a job on this backend.
    pub fn run<J: Job>(&self, job: J) -> J::Output {
        match self {
            #[cfg(feature = "flex")]
            Self::Flex => {
                job.run::<Autodiff<burn_flex::Flex>>(&Default::default(), Strategies::tiled())
            }
            #[cfg(feature = "ndarray")]
            Self::Ndarray => {
                job.run::<Autodiff<burn_ndarray::NdArray>>(&Default::default(), Strategies::tiled())
            }
            #[cfg(feature = "wgpu")]
            Self::Wgpu { device, .. } => {
                job.run::<Autodiff<burn_wgpu::Wgpu>>(device, Strategies::on_device())
            }
            #[cfg(feature = "cuda")]
            Self::Cuda => {
                job.run::<Autodiff<burn_cuda::Cuda>>(&Default::default(), Strategies::on_device())
            }
        }
    }

    /// The name on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            #[cfg(feature = "flex")]
            Self::Flex => "flex",
            #[cfg(feature = "ndarray")]
            Self::Ndarray => "ndarray",
            #[cfg(feature = "wgpu")]
            Self::Wgpu { .. } => "wgpu",
            #[cfg(feature = "cuda")]
            Self::Cuda => "cuda",
        }
    }
}

impl std::fmt::Display for Backend {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            #[cfg(feature = "flex")]
            Self::Flex => f.write_str("flex (CPU)"),
            #[cfg(feature = "ndarray")]
            Self::Ndarray => f.write_str("ndarray (CPU)"),
            #[cfg(feature = "wgpu")]
            Self::Wgpu { adapter, .. } => write!(f, "wgpu ({adapter})"),
            #[cfg(feature = "cuda")]
            Self::Cuda => f.write_str("cuda"),
        }
    }
}

/// A real GPU if there is one, else the CPU.
fn auto() -> Result<Backend, Failure> {
    #[cfg(feature = "cuda")]
    if let Some(backend) = cuda() {
        return Ok(backend);
    }
    #[cfg(feature = "wgpu")]
    if let Some(backend) = adapters::best(adapters::Kind::is_gpu) {
        return Ok(backend);
    }
    let flex = Backend::choose(BackendName::Flex);
    flex.or_else(|_| Backend::choose(BackendName::Ndarray))
}

/// The first CUDA device.
#[cfg(feature = "cuda")]
pub fn cuda() -> Option<Backend> {
    use burn::tensor::backend::Backend as _;
    // Without the driver's library, asking for devices panics.
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let count = std::panic::catch_unwind(|| burn_cuda::Cuda::<f32, i32>::device_count(0));
    std::panic::set_hook(hook);
    (count.unwrap_or(0) > 0).then_some(Backend::Cuda)
}

/// The graphics adapters that wgpu finds.
#[cfg(feature = "wgpu")]
pub mod adapters {
    use burn_wgpu::WgpuDevice;
    use burn_wgpu::graphics::{AutoGraphicsApi, GraphicsApi};

    use super::Backend;

    /// What an adapter is made of, best first.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Kind {
        Discrete,
        Integrated,
        Virtual,
        Software,
    }

    impl Kind {
        /// Whether it is hardware.
        pub fn is_gpu(self) -> bool {
            self != Kind::Software
        }

        /// How a table calls it.
        pub fn label(self) -> &'static str {
            match self {
                Kind::Discrete => "discrete GPU",
                Kind::Integrated => "integrated GPU",
                Kind::Virtual => "virtual GPU",
                Kind::Software => "software",
            }
        }
    }

    /// One adapter.
    #[derive(Debug, Clone)]
    pub struct Adapter {
        pub kind: Kind,
        pub name: String,
        pub api: String,
        pub device: WgpuDevice,
    }

    /// The adapters of the graphics API that Burn uses on this system, in its order.
    pub fn find() -> Vec<Adapter> {
        let api = AutoGraphicsApi::backend();
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor {
            backends: api.into(),
            ..wgpu::InstanceDescriptor::new_without_display_handle()
        });
        let found = burn::tensor::try_read_sync(instance.enumerate_adapters(api.into()))
            .unwrap_or_default();
        let mut counts = [0; 3];
        let mut next = |kind: usize| {
            counts[kind] += 1;
            counts[kind] - 1
        };
        found
            .into_iter()
            .map(|adapter| {
                let info = adapter.get_info();
                let (kind, device) = match info.device_type {
                    wgpu::DeviceType::DiscreteGpu => {
                        (Kind::Discrete, WgpuDevice::DiscreteGpu(next(0)))
                    }
                    wgpu::DeviceType::IntegratedGpu => {
                        (Kind::Integrated, WgpuDevice::IntegratedGpu(next(1)))
                    }
                    wgpu::DeviceType::VirtualGpu => {
                        (Kind::Virtual, WgpuDevice::VirtualGpu(next(2)))
                    }
                    _ => (Kind::Software, WgpuDevice::Cpu),
                };
                Adapter {
                    kind,
                    name: info.name,
                    api: info.backend.to_string(),
                    device,
                }
            })
            .collect()
    }

    /// The best adapter of an accepted kind, the first of its kind.
    pub fn best(accepted: impl Fn(Kind) -> bool) -> Option<Backend> {
        let adapter = find()
            .into_iter()
            .filter(|adapter| accepted(adapter.kind))
            .min_by_key(|adapter| adapter.kind)?;
        Some(Backend::Wgpu {
            device: adapter.device,
            adapter: adapter.name,
        })
    }
}
