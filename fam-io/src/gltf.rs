//! glTF 2.0, as GLB and as JSON.

mod checker;
mod glb;
mod package;
mod seam_lines;

use std::io::{self, Write};

use crate::document::{Content, Parsed};
use crate::scene::Scene;
use crate::{Format, ReadFault, Uvs, WriteFault, WriteOptions};

pub(crate) use package::Package;

/// A glTF document, to be written back.
#[derive(Debug, Clone)]
pub(crate) struct Source {
    format: Format,
}

pub(crate) fn parse(_content: Content) -> Result<Parsed<Source>, ReadFault> {
    Err(ReadFault::Unsupported("glTF is".to_owned()))
}

impl Source {
    pub fn format(&self) -> Format {
        self.format
    }

    pub fn scene(&self) -> io::Result<Scene> {
        Ok(Scene::default())
    }

    pub fn write(
        &self,
        _uvs: &Uvs,
        format: Format,
        _options: &WriteOptions,
        _out: &mut dyn Write,
    ) -> Result<(), WriteFault> {
        Err(WriteFault::NoPlaceForUvs(format))
    }
}
