//! An atlas as a safetensors file: the weights of map `i` under `<i>.` and then their name in
//! [`weights`](crate::weights), its landmarks `[L, 3]`, normalised by `frame`, as
//! `<i>.landmarks`, and everything else as metadata.

use std::sync::Arc;

use burn::tensor::backend::Backend;
use safetensors::tensor::SafeTensors;
use serde::{Deserialize, Serialize};

use super::{Atlas, Chart, ComponentMap, Placement, Projection};
use crate::map::{Metadata, ModelFileError, TrainedMap, model_file, read_metadata};
use crate::weights::{self, WeightsError};
use fam_surface::Normalization;

/// Version of the metadata.
const FORMAT_VERSION: u32 = 3;

/// The first that is still read; its maps are never shared.
const FIRST_VERSION: u32 = 2;

#[derive(Serialize, Deserialize)]
struct Header {
    version: u32,
    /// Of all landmarks; none where they tell no charts apart.
    frame: Option<Normalization>,
    charts: Vec<ChartHeader>,
}

#[derive(Serialize, Deserialize)]
struct ChartHeader {
    map: MapHeader,
    placement: Placement,
    landmarks: usize,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum MapHeader {
    Projected(Projection),
    Trained(Metadata),
    /// That of an earlier chart.
    Shared(usize),
}

pub(super) fn write<B: Backend>(atlas: &Atlas<B>) -> Result<Vec<u8>, ModelFileError> {
    let mut tensors = Vec::new();
    let mut charts = Vec::new();
    let all: Vec<_> = atlas
        .charts
        .iter()
        .flat_map(|c| c.landmarks.iter().copied())
        .collect();
    let frame = Normalization::of(&all).ok();
    for (i, chart) in atlas.charts.iter().enumerate() {
        let map = match &chart.map {
            ComponentMap::Projected(projection) => MapHeader::Projected(*projection),
            ComponentMap::Trained(map) => {
                let same = |other: &Chart<B>| match &other.map {
                    ComponentMap::Trained(other) => Arc::ptr_eq(other, map),
                    ComponentMap::Projected(_) => false,
                };
                let first = atlas.charts[..i].iter().position(same);
                match first {
                    Some(first) => MapHeader::Shared(first),
                    None => {
                        tensors.extend(weights::tensors(map.model(), &format!("{i}.")));
                        MapHeader::Trained(map.metadata())
                    }
                }
            }
        };
        if let Some(frame) = frame {
            let rows = chart.landmarks.iter().flat_map(|&p| frame.apply(p));
            tensors.push((
                landmarks_name(i),
                vec![chart.landmarks.len(), 3],
                rows.flat_map(f32::to_le_bytes).collect(),
            ));
        }
        charts.push(ChartHeader {
            map,
            placement: chart.placement,
            landmarks: chart.landmarks.len(),
        });
    }
    let version = FORMAT_VERSION;
    let header = Header {
        version,
        frame,
        charts,
    };
    model_file(&tensors, &header)
}

fn landmarks_name(chart: usize) -> String {
    format!("{chart}.landmarks")
}

pub(super) fn read<B: Backend>(
    bytes: &[u8],
    device: &B::Device,
) -> Result<Atlas<B>, ModelFileError> {
    let version: Version = read_metadata(bytes)?;
    if !(FIRST_VERSION..=FORMAT_VERSION).contains(&version.version) {
        let problem = format!("version {} of its format is not supported", version.version);
        return Err(ModelFileError::Metadata(problem));
    }
    let header: Header = read_metadata(bytes)?;
    let file = SafeTensors::deserialize(bytes).map_err(WeightsError::from)?;
    let frame = header.frame;
    let mut charts = Vec::with_capacity(header.charts.len());
    for (i, header) in header.charts.into_iter().enumerate() {
        let chart = chart(&file, i, header, &charts, frame, device)?;
        charts.push(chart);
    }
    if charts.is_empty() {
        return Err(ModelFileError::Metadata("it holds no map".to_string()));
    }
    Ok(Atlas { charts })
}

#[derive(Deserialize)]
struct Version {
    version: u32,
}

fn chart<B: Backend>(
    file: &SafeTensors<'_>,
    i: usize,
    header: ChartHeader,
    earlier: &[Chart<B>],
    frame: Option<Normalization>,
    device: &B::Device,
) -> Result<Chart<B>, ModelFileError> {
    let Placement { scale, offset } = header.placement;
    if !(scale.is_finite() && offset.iter().all(|c| c.is_finite())) {
        let problem = "a placement is not finite".to_string();
        return Err(ModelFileError::Metadata(problem));
    }
    let map = match header.map {
        MapHeader::Projected(projection) => {
            let mut values = projection.axes.iter().flatten().chain(&projection.origin);
            if !values.all(|c| c.is_finite()) {
                let problem = "a projection is not finite".to_string();
                return Err(ModelFileError::Metadata(problem));
            }
            ComponentMap::Projected(projection)
        }
        MapHeader::Trained(metadata) => {
            let map = TrainedMap::from_file(file, &format!("{i}."), metadata, device)?;
            ComponentMap::Trained(Arc::new(map))
        }
        MapHeader::Shared(first) => match earlier.get(first) {
            Some(chart) => chart.map.clone(),
            None => {
                let problem = "a map is that of a chart that is not there".to_string();
                return Err(ModelFileError::Metadata(problem));
            }
        },
    };
    let landmarks = match frame {
        None => Vec::new(),
        Some(frame) => {
            let name = landmarks_name(i);
            let shape = [header.landmarks, 3];
            let values = weights::floats(&weights::find(file, &name)?, &name, &shape)?;
            let rows: &[[f32; 3]] = values.as_chunks().0;
            rows.iter().map(|&row| frame.invert(row)).collect()
        }
    };
    Ok(Chart {
        map,
        placement: header.placement,
        landmarks,
    })
}
