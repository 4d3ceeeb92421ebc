//! Clouds that are read and written a piece at a time, whatever their size.
//!
//! [`CloudStream`] takes XYZ, and binary PLY that has nothing but points. What it writes is what
//! [`Document`](crate::Document) writes, byte for byte; only its memory does not grow with the number
//! of points. Lines of text, and comments before the first point, are held as they are.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use crate::atomic::write_file;
use crate::error::{ReadError, ReadFault, WriteError, WriteFault};
use crate::format::Format;
use crate::kept::{self, Kept};
use crate::text::{Edits, Line, lines};
use crate::uvs::{check_count, is_finite};
use crate::warning::Warning;
use crate::{detect, ply, xyz};

/// Points of a binary file that are read at once.
const POINTS: usize = 1 << 16;

/// Bytes of a text that are read at once: about as many points.
const BYTES: usize = 1 << 22;

/// A point cloud in a file.
#[derive(Debug)]
pub struct CloudStream {
    path: PathBuf,
    cloud: Cloud,
    warnings: Vec<Warning>,
}

#[derive(Debug)]
enum Cloud {
    Xyz(xyz::Columns),
    Ply(Box<ply::Records>),
}

/// Why a cloud was not written again.
#[derive(Debug, thiserror::Error)]
pub enum StreamError {
    /// It could not be read to its end.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The copy could not be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// There were no UVs for some points.
    #[error("it was broken off")]
    BrokenOff,
}

impl CloudStream {
    /// The cloud in a file; none if the file is of another kind, or a pipe. It is read to its end
    /// once, to find out what the columns of a text are, and which points are left out.
    ///
    /// # Errors
    /// The file cannot be read, or it breaks the rules of its format.
    pub fn open(path: impl AsRef<Path>) -> Result<Option<Self>, ReadError> {
        let path = path.as_ref();
        let cloud = open(path).map_err(|fault| at(path, fault))?;
        Ok(cloud.map(|(cloud, warnings)| Self {
            path: path.to_owned(),
            cloud,
            warnings,
        }))
    }

    /// What is left out of the file, for the user to know.
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// The format of the file.
    pub fn format(&self) -> Format {
        match self.cloud {
            Cloud::Xyz(_) => Format::Xyz,
            Cloud::Ply(_) => Format::Ply,
        }
    }

    /// Writes the file again, in its own format, with the UVs that `uvs` gives some points at a
    /// time, one each and in their order, in the place of any UVs it had; none to break off. Only
    /// points with finite coordinates are shown to it.
    ///
    /// # Errors
    /// The file cannot be read any more or the copy not be written, a UV is not finite, there is not one UV for each point, or `uvs` breaks off. There is no copy then.
    pub fn write_uvs(
        &self,
        path: impl AsRef<Path>,
        mut uvs: impl FnMut(&[[f64; 3]]) -> Option<Vec<[f32; 2]>>,
    ) -> Result<(), StreamError> {
        let mut unread = None;
        let mut broken_off = false;
        let mut first = 0;
        let mut checked = |positions: &[[f64; 3]]| {
            let Some(uvs) = uvs(positions) else {
                broken_off = true;
                return Err(WriteFault::Io(io::ErrorKind::Interrupted.into()));
            };
            check_count("points", positions.len(), uvs.len())?;
            if let Some(at) = uvs.iter().position(|uv| !is_finite(uv)) {
                return Err(WriteFault::NonFiniteUv(first + at));
            }
            first += uvs.len();
            Ok(uvs)
        };
        let written = write_file(path.as_ref(), |out| {
            let outcome = match &self.cloud {
                Cloud::Xyz(columns) => self.write_xyz(columns, &mut checked, out),
                Cloud::Ply(records) => self.write_ply(records, &mut checked, out),
            };
            outcome.map_err(|stop| match stop {
                Stop::Read(fault) => {
                    unread = Some(fault);
                    WriteFault::Io(io::Error::other("its source cannot be read"))
                }
                Stop::Write(fault) => fault,
            })
        });
        match unread {
            _ if broken_off => Err(StreamError::BrokenOff),
            Some(fault) => Err(at(&self.path, fault).into()),
            None => Ok(written?),
        }
    }

    fn write_xyz(
        &self,
        columns: &xyz::Columns,
        uvs: &mut CheckedUvs,
        out: &mut dyn Write,
    ) -> Result<(), Stop> {
        let mut reader = xyz::Reader::default();
        let mut is_first = true;
        for block in TextBlocks::open(&self.path).map_err(ReadFault::from)? {
            let block = block.map_err(ReadFault::from)?;
            let (mut points, mut positions) = (Vec::new(), Vec::new());
            let mut edits = Edits::default();
            for line in block.lines() {
                let Some(point) = reader.line(&block.bytes, &line)? else {
                    continue;
                };
                match point.position {
                    Some(position) => {
                        points.push(point.columns);
                        positions.push(position);
                    }
                    None => columns.edit_left_out(&block.bytes, point.columns, &mut edits),
                }
            }
            if std::mem::take(&mut is_first) {
                columns.edit_header(&block.bytes, &mut edits);
            }
            if !points.is_empty() {
                for (point, uv) in points.into_iter().zip(uvs(&positions)?) {
                    columns.edit(&block.bytes, point, uv, &mut edits);
                }
            }
            edits.apply(&block.bytes, out)?;
        }
        Ok(())
    }

    fn write_ply(
        &self,
        records: &ply::Records,
        uvs: &mut CheckedUvs,
        out: &mut dyn Write,
    ) -> Result<(), Stop> {
        records.write_header(out)?;
        let mut file = read_records(&self.path, records, |block| {
            let positions = records.positions(&block);
            let kept = Kept::of(&positions);
            let positions = kept.only(positions);
            let uvs = match positions.is_empty() {
                true => Vec::new(),
                false => uvs(&positions)?,
            };
            Ok::<_, Stop>(block.write(kept.uvs_of_all(&uvs), out)?)
        })?;
        // What a file has beyond its points stays.
        io::copy(&mut file, out)?;
        Ok(())
    }
}

/// The UVs of some points, one finite one for each.
type CheckedUvs<'a> = dyn FnMut(&[[f64; 3]]) -> Result<Vec<[f32; 2]>, WriteFault> + 'a;

/// Why writing stopped.
enum Stop {
    Read(ReadFault),
    Write(WriteFault),
}

impl From<ReadFault> for Stop {
    fn from(fault: ReadFault) -> Self {
        Self::Read(fault)
    }
}

impl From<WriteFault> for Stop {
    fn from(fault: WriteFault) -> Self {
        Self::Write(fault)
    }
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        Self::Write(error.into())
    }
}

fn at(path: &Path, fault: ReadFault) -> ReadError {
    ReadError {
        path: path.to_owned(),
        fault,
    }
}

/// Shows `each` of the blocks of a binary file; returns the file, which is read as far as the
/// points go.
fn read_records<E: From<ReadFault>>(
    path: &Path,
    records: &ply::Records,
    mut each: impl FnMut(ply::Block) -> Result<(), E>,
) -> Result<BufReader<File>, E> {
    let open = || {
        let mut file = BufReader::new(File::open(path)?);
        file.seek(SeekFrom::Start(records.start()))?;
        Ok::<_, io::Error>(file)
    };
    let mut file = open().map_err(ReadFault::from)?;
    let mut done = 0;
    while done < records.count {
        let count = (records.count - done).min(POINTS as u64) as usize;
        each(records.read(count, &mut file).map_err(ReadFault::from)?)?;
        done += count as u64;
    }
    Ok(file)
}

fn open(path: &Path) -> Result<Option<(Cloud, Vec<Warning>)>, ReadFault> {
    let metadata = std::fs::metadata(path)?;
    if !metadata.is_file() {
        return Ok(None);
    }
    match detect::format_of(path)? {
        Format::Ply => {
            let mut file = File::open(path)?;
            let Some(records) = ply::Records::open(&mut file, metadata.len())? else {
                return Ok(None);
            };
            let (mut left_out, mut total) = (0, 0);
            read_records(path, &records, |block| {
                let positions = records.positions(&block);
                left_out += Kept::of(&positions).left_out().len();
                total += positions.len();
                Ok::<_, ReadFault>(())
            })?;
            let warnings = kept::warnings(left_out, total)?;
            Ok(Some((Cloud::Ply(Box::new(records)), warnings)))
        }
        Format::Xyz => {
            let mut reader = xyz::Reader::default();
            for block in TextBlocks::open(path)? {
                let block = block?;
                for line in block.lines() {
                    reader.line(&block.bytes, &line)?;
                }
            }
            let (columns, warnings) = reader.finish()?;
            Ok(Some((Cloud::Xyz(columns), warnings)))
        }
        _ => Ok(None),
    }
}

/// Whole lines of a text.
struct TextBlock {
    bytes: Vec<u8>,
    /// Lines before the first.
    before: usize,
}

impl TextBlock {
    fn lines(&self) -> impl Iterator<Item = Line> {
        lines(&self.bytes).map(|line| Line {
            number: self.before + line.number,
            ..line
        })
    }
}

/// A text in pieces that end where lines end.
struct TextBlocks {
    file: File,
    /// What is read of the next piece.
    rest: Vec<u8>,
    lines: usize,
    ended: bool,
}

impl TextBlocks {
    fn open(path: &Path) -> io::Result<Self> {
        Ok(Self {
            file: File::open(path)?,
            rest: Vec::new(),
            lines: 0,
            ended: false,
        })
    }

    fn read(&mut self) -> io::Result<Option<TextBlock>> {
        let mut bytes = std::mem::take(&mut self.rest);
        let mut end = last_line_end(&bytes, 0);
        while end.is_none() && !self.ended {
            let known = bytes.len();
            let mut more = Read::by_ref(&mut self.file).take(BYTES as u64);
            self.ended = more.read_to_end(&mut bytes)? == 0;
            end = last_line_end(&bytes, known);
        }
        if !self.ended
            && let Some(end) = end
        {
            self.rest = bytes.split_off(end);
        }
        if bytes.is_empty() {
            return Ok(None);
        }
        let block = TextBlock {
            bytes,
            before: self.lines,
        };
        self.lines += lines(&block.bytes).count();
        Ok(Some(block))
    }
}

impl Iterator for TextBlocks {
    type Item = io::Result<TextBlock>;

    fn next(&mut self) -> Option<Self::Item> {
        self.read().transpose()
    }
}

/// Where the last line ends that is known to have ended: after `\r`, a `\n` may be to come.
/// None is before the byte before `searched`.
fn last_line_end(bytes: &[u8], searched: usize) -> Option<usize> {
    let from = searched.saturating_sub(1).min(bytes.len());
    let (skipped, bytes) = bytes.split_at(from);
    let known = &bytes[..bytes.len().saturating_sub(1)];
    let end = known
        .iter()
        .rposition(|b| *b == b'\r')
        .map(|at| match bytes.get(at + 1) {
            Some(b'\n') => at + 2,
            _ => at + 1,
        });
    let newline = bytes.iter().rposition(|b| *b == b'\n').map(|at| at + 1);
    end.max(newline).map(|end| skipped.len() + end)
}
