use burn_cubecl::CubeRuntime;
use burn_cubecl::cubecl::{self, prelude::*};
use burn_cubecl::kernel::into_contiguous;
use burn_cubecl::ops::numeric::empty_device_contiguous_dtype;
use burn_cubecl::tensor::CubeTensor;

/// Rows of one workgroup, and points or indices that it holds in shared memory at once: small
/// enough for every graphics API (1 KiB), and at the paper's 10,000 points a group for each
/// multiprocessor of a large GPU.
const GROUP: u32 = 64;

/// For each of `queries` `[M, D]` the indices of its `k` nearest `points` `[N, D]`, nearest first,
/// in `[M · k]`. With `others`, the queries are the points, and none is its own neighbour.
pub(super) fn nearest<R: CubeRuntime>(
    points: CubeTensor<R>,
    queries: CubeTensor<R>,
    k: usize,
    others: bool,
) -> CubeTensor<R> {
    let points = into_contiguous(points);
    let queries = into_contiguous(queries);
    let (count, dimension) = (queries.meta.shape()[0], queries.meta.shape()[1]);
    let output = empty_device_contiguous_dtype(
        queries.client.clone(),
        queries.device.clone(),
        [count * k].into(),
        burn::tensor::DType::I32,
    );
    nearest_kernel::launch::<R>(
        &output.client,
        CubeCount::Static((count as u32).div_ceil(GROUP), 1, 1),
        CubeDim::new_1d(GROUP),
        points.into_array_arg(),
        queries.into_array_arg(),
        output.clone().into_array_arg(),
        dimension,
        k,
        others,
    );
    output
}

/// One unit for each query. The group goes through all points together, a tile of them at a time.
#[cube(launch)]
fn nearest_kernel(
    points: &Array<f32>,
    queries: &Array<f32>,
    output: &mut Array<i32>,
    #[comptime] dimension: usize,
    #[comptime] k: usize,
    #[comptime] others: bool,
) {
    let group = comptime!(GROUP as usize);
    let count = points.len() / dimension;
    let query = ABSOLUTE_POS;
    let is_query = query < queries.len() / dimension;

    let mut position = Array::<f32>::new(dimension);
    let mut distances = Array::<f32>::new(k);
    let mut nearest = Array::<i32>::new(k);
    #[unroll]
    for c in 0..dimension {
        position[c] = 0.0;
    }
    if is_query {
        #[unroll]
        for c in 0..dimension {
            position[c] = queries[query * dimension + c];
        }
    }
    #[unroll]
    for i in 0..k {
        // Shaders know no infinity.
        distances[i] = f32::MAX;
        nearest[i] = 0;
    }

    let mut tile = SharedMemory::<f32>::new(comptime!(GROUP as usize * dimension));
    let tiles = count.div_ceil(group);
    for t in 0..tiles {
        let first = t * group;
        let own = first + UNIT_POS as usize;
        if own < count {
            #[unroll]
            for c in 0..dimension {
                tile[UNIT_POS as usize * dimension + c] = points[own * dimension + c];
            }
        }
        sync_cube();
        let filled = min(group, count - first);
        for j in 0..filled {
            let mut distance = 0.0f32;
            #[unroll]
            for c in 0..dimension {
                let difference = tile[j * dimension + c] - position[c];
                distance += difference * difference;
            }
            let mut candidate = true;
            if others {
                candidate = first + j != query;
            }
            if candidate && distance < distances[k - 1] {
                // The last one leaves; the new one moves forward past those that are farther.
                distances[k - 1] = distance;
                nearest[k - 1] = i32::cast_from(first + j);
                #[unroll]
                for i in 1..k {
                    let at = comptime!(k - i);
                    if distances[at] < distances[at - 1] {
                        let farther = distances[at - 1];
                        distances[at - 1] = distances[at];
                        distances[at] = farther;
                        let index = nearest[at - 1];
                        nearest[at - 1] = nearest[at];
                        nearest[at] = index;
                    }
                }
            }
        }
        sync_cube();
    }

    if is_query {
        #[unroll]
        for i in 0..k {
            output[query * k + i] = nearest[i];
        }
    }
}

/// The sums `[rows, D]` of those of `values` `[M, D]` that have the same index in `indices` `[M]`,
/// in their order.
pub(super) fn sum_by_index<R: CubeRuntime>(
    values: CubeTensor<R>,
    indices: CubeTensor<R>,
    rows: usize,
) -> CubeTensor<R> {
    let values = into_contiguous(values);
    let indices = into_contiguous(indices);
    let dimension = values.meta.shape()[1];
    let output = empty_device_contiguous_dtype(
        values.client.clone(),
        values.device.clone(),
        [rows, dimension].into(),
        burn::tensor::DType::F32,
    );
    sum_by_index_kernel::launch::<R>(
        &output.client,
        CubeCount::Static((rows as u32).div_ceil(GROUP), 1, 1),
        CubeDim::new_1d(GROUP),
        values.into_array_arg(),
        indices.into_array_arg(),
        output.clone().into_array_arg(),
        dimension,
    );
    output
}

/// One unit for each row of the output. The group goes through all indices together.
#[cube(launch)]
fn sum_by_index_kernel(
    values: &Array<f32>,
    indices: &Array<i32>,
    output: &mut Array<f32>,
    #[comptime] dimension: usize,
) {
    let group = comptime!(GROUP as usize);
    let count = indices.len();
    let row = ABSOLUTE_POS;

    let mut sum = Array::<f32>::new(dimension);
    #[unroll]
    for c in 0..dimension {
        sum[c] = 0.0;
    }

    let mut tile = SharedMemory::<i32>::new(comptime!(GROUP as usize));
    let tiles = count.div_ceil(group);
    for t in 0..tiles {
        let first = t * group;
        let own = first + UNIT_POS as usize;
        if own < count {
            tile[UNIT_POS as usize] = indices[own];
        }
        sync_cube();
        let filled = min(group, count - first);
        for j in 0..filled {
            if tile[j] == i32::cast_from(row) {
                #[unroll]
                for c in 0..dimension {
                    sum[c] += values[(first + j) * dimension + c];
                }
            }
        }
        sync_cube();
    }

    if row < output.len() / dimension {
        #[unroll]
        for c in 0..dimension {
            output[row * dimension + c] = sum[c];
        }
    }
}
