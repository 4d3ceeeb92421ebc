use burn::tensor::{Int, Tensor, TensorData, backend::Backend};
use fam_surface::neighbors::{nearest, nearest_others};

use super::NeighborSearch;

/// Nearest neighbours on the host, by a `kiddo` k-d tree built for each call.
#[derive(Debug, Clone, Copy, Default)]
pub struct KdTree;

impl<B: Backend> NeighborSearch<B> for KdTree {
    fn nearest(&self, points: Tensor<B, 2>, queries: Tensor<B, 2>) -> Tensor<B, 1, Int> {
        let device = points.device();
        let indices = match points.dims()[1] {
            2 => nearest::<2>(&rows(points), &rows(queries)),
            _ => nearest::<3>(&rows(points), &rows(queries)),
        };
        index_tensor(indices, &device)
    }

    fn nearest_others(&self, points: Tensor<B, 2>, k: usize) -> Tensor<B, 1, Int> {
        let device = points.device();
        let indices = match points.dims()[1] {
            2 => nearest_others::<2>(&rows(points), k),
            _ => nearest_others::<3>(&rows(points), k),
        };
        index_tensor(indices, &device)
    }
}

/// The rows of a tensor `[N, D]` on the host.
pub(crate) fn rows<B: Backend, const D: usize>(tensor: Tensor<B, 2>) -> Vec<[f32; D]> {
    let data = tensor.into_data().convert::<f32>();
    let values = data.as_slice::<f32>().expect("converted to f32");
    values.as_chunks::<D>().0.to_vec()
}

fn index_tensor<B: Backend>(indices: Vec<u32>, device: &B::Device) -> Tensor<B, 1, Int> {
    let count = indices.len();
    let indices: Vec<i32> = indices.into_iter().map(|i| i as i32).collect();
    Tensor::from_data(TensorData::new(indices, [count]), device)
}
