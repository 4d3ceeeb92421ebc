//! STL, ASCII and binary.

use crate::ReadFault;
use crate::document::Parsed;

/// An STL file; nothing of it is written back.
#[derive(Debug, Clone)]
pub(crate) struct Source;

pub(crate) fn parse(_bytes: &[u8]) -> Result<Parsed<Source>, ReadFault> {
    Err(ReadFault::Unsupported("STL is".to_owned()))
}
