use std::marker::PhantomData;

use burn::tensor::DType;
use burn::tensor::ops::{FloatTensor, IntTensor};
use burn_cubecl::fusion::FusionCubeRuntime;
use burn_cubecl::{BoolElement, CubeBackend, CubeRuntime, FloatElement, IntElement};
use burn_fusion::stream::{Operation, OperationStreams};
use burn_fusion::{Fusion, FusionHandle};
use burn_ir::{CustomOpIr, HandleContainer, OperationIr, TensorIr};

use super::{BruteForceBackend, kernel};

impl<R, F, I, BT> BruteForceBackend for Fusion<CubeBackend<R, F, I, BT>>
where
    R: CubeRuntime,
    F: FloatElement,
    I: IntElement,
    BT: BoolElement,
{
    fn brute_force(
        points: FloatTensor<Self>,
        queries: FloatTensor<Self>,
        k: usize,
        others: bool,
    ) -> IntTensor<Self> {
        let streams = OperationStreams::with_inputs([&points, &queries]);
        let client = queries.client.clone();
        let indices = TensorIr::uninit(
            client.create_empty_handle(),
            [queries.shape[0] * k].into(),
            DType::I32,
        );
        let ir = CustomOpIr::new(
            "nearest",
            &[points.into_ir(), queries.into_ir()],
            &[indices],
        );
        let operation = Nearest::<R, F, I, BT> {
            ir: ir.clone(),
            k,
            others,
            backend: PhantomData,
        };
        let mut outputs = client.register(streams, OperationIr::Custom(ir), operation);
        outputs.remove(0)
    }

    fn sum_by_index(
        values: FloatTensor<Self>,
        indices: IntTensor<Self>,
        rows: usize,
    ) -> FloatTensor<Self> {
        let streams = OperationStreams::with_inputs([&values, &indices]);
        let client = values.client.clone();
        let sums = TensorIr::uninit(
            client.create_empty_handle(),
            [rows, values.shape[1]].into(),
            DType::F32,
        );
        let ir = CustomOpIr::new(
            "sum by index",
            &[values.into_ir(), indices.into_ir()],
            &[sums],
        );
        let operation = SumByIndex::<R, F, I, BT> {
            ir: ir.clone(),
            rows,
            backend: PhantomData,
        };
        let mut outputs = client.register(streams, OperationIr::Custom(ir), operation);
        outputs.remove(0)
    }
}

/// The search as one operation of a stream.
#[derive(Debug)]
struct Nearest<R: CubeRuntime, F, I, BT> {
    ir: CustomOpIr,
    k: usize,
    others: bool,
    backend: PhantomData<(R, F, I, BT)>,
}

impl<R, F, I, BT> Operation<FusionCubeRuntime<R>> for Nearest<R, F, I, BT>
where
    R: CubeRuntime,
    F: FloatElement,
    I: IntElement,
    BT: BoolElement,
{
    fn execute(&self, handles: &mut HandleContainer<FusionHandle<FusionCubeRuntime<R>>>) {
        let ([points, queries], [indices]) = self.ir.as_fixed();
        let points = handles.get_float_tensor::<CubeBackend<R, F, I, BT>>(points);
        let queries = handles.get_float_tensor::<CubeBackend<R, F, I, BT>>(queries);
        let found = kernel::nearest(points, queries, self.k, self.others);
        handles.register_int_tensor::<CubeBackend<R, F, I, BT>>(&indices.id, found);
    }
}

/// The sums as one operation of a stream.
#[derive(Debug)]
struct SumByIndex<R: CubeRuntime, F, I, BT> {
    ir: CustomOpIr,
    rows: usize,
    backend: PhantomData<(R, F, I, BT)>,
}

impl<R, F, I, BT> Operation<FusionCubeRuntime<R>> for SumByIndex<R, F, I, BT>
where
    R: CubeRuntime,
    F: FloatElement,
    I: IntElement,
    BT: BoolElement,
{
    fn execute(&self, handles: &mut HandleContainer<FusionHandle<FusionCubeRuntime<R>>>) {
        let ([values, indices], [sums]) = self.ir.as_fixed();
        let values = handles.get_float_tensor::<CubeBackend<R, F, I, BT>>(values);
        let indices = handles.get_int_tensor::<CubeBackend<R, F, I, BT>>(indices);
        let found = kernel::sum_by_index(values, indices, self.rows);
        handles.register_float_tensor::<CubeBackend<R, F, I, BT>>(&sums.id, found);
    }
}
