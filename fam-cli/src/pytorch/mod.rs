//! State dictionaries of PyTorch (`.pth`): named tensors in a zip archive, described by a pickle.

mod pickle;

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Cursor, Read, Write};
use std::path::Path;

use fam_core::weights::NamedTensor;
use fam_io::atomic::write_atomically;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

use crate::failure::Failure;
use pickle::Tensor;

/// Most bytes of a part of an archive, and of all tensors: a model of the paper has 15 MB.
const LARGEST: u64 = 1 << 30;

/// Most bytes of a pickle: that of a model has 10 kB.
const LARGEST_PICKLE: u64 = 1 << 24;

/// The tensors of a state dictionary, also where it is a value of another dictionary.
pub fn read(path: &Path) -> Result<Vec<NamedTensor>, Failure> {
    let fail = |reason: String| Failure::input(format!("{}: {reason}", path.display()));
    let file = File::open(path).map_err(|error| fail(error.to_string()))?;
    let mut archive = ZipArchive::new(file)
        .map_err(|error| fail(format!("it is no file of PyTorch 1.6 or later: {error}")))?;
    let pickle = archive
        .file_names()
        .filter_map(|name| Some(name.ok()?.into_owned()))
        .find(|name| name.ends_with("data.pkl"))
        .ok_or_else(|| fail(String::from("it is no file of PyTorch: it has no data.pkl")))?;
    let folder = pickle.trim_end_matches("data.pkl").to_owned();
    let mut entry = |name: &str, largest: u64| -> Result<Vec<u8>, Failure> {
        let mut bytes = Vec::new();
        let entry = archive.by_name(name);
        let entry = entry.map_err(|error| fail(format!("{name}: {error}")))?;
        let read = entry.take(largest + 1).read_to_end(&mut bytes);
        read.map_err(|error| fail(format!("{name}: {error}")))?;
        match bytes.len() as u64 > largest {
            true => Err(fail(format!("{name} has more than {largest} bytes"))),
            false => Ok(bytes),
        }
    };
    if entry(&format!("{folder}byteorder"), LARGEST_PICKLE)
        .is_ok_and(|order| order.trim_ascii() == b"big")
    {
        return Err(fail(String::from("its numbers are big-endian")));
    }
    let tensors = pickle::tensors(&entry(&pickle, LARGEST_PICKLE)?).map_err(&fail)?;
    let mut storages: HashMap<String, Vec<u8>> = HashMap::new();
    let (mut found, mut total) = (Vec::new(), 0);
    for (name, tensor) in tensors {
        let key = tensor.storage.clone();
        if !storages.contains_key(&key) {
            let bytes = entry(&format!("{folder}data/{key}"), LARGEST)?;
            storages.insert(key.clone(), bytes);
        }
        let values = values(&tensor, &storages[&key]);
        let values = values.ok_or_else(|| fail(format!("the tensor {name} is damaged")))?;
        total += 4 * values.len() as u64;
        if total > LARGEST {
            return Err(fail(format!("its tensors have more than {LARGEST} bytes")));
        }
        let bytes = values.into_iter().flat_map(f32::to_le_bytes).collect();
        found.push((name, tensor.shape, bytes));
    }
    Ok(found)
}

/// The values of a tensor, row by row; none if its storage has too few.
fn values(tensor: &Tensor, storage: &[u8]) -> Option<Vec<f32>> {
    let count = tensor
        .shape
        .iter()
        .try_fold(1_usize, |n, &d| n.checked_mul(d))?;
    let size = tensor.number.size();
    // Views that repeat values are in no model.
    if count.checked_mul(size)? > storage.len() {
        return None;
    }
    let mut index = vec![0; tensor.shape.len()];
    let mut values = Vec::with_capacity(count);
    for _ in 0..count {
        let mut along = index.iter().zip(&tensor.strides);
        let place = along.try_fold(tensor.offset, |place, (i, stride): (&usize, &usize)| {
            place.checked_add(i.checked_mul(*stride)?)
        });
        let at = place?.checked_mul(size)?;
        values.push(tensor.number.read(storage.get(at..at.checked_add(size)?)?));
        for axis in (0..index.len()).rev() {
            index[axis] += 1;
            if index[axis] < tensor.shape[axis] {
                break;
            }
            index[axis] = 0;
        }
    }
    Some(values)
}

/// Writes tensors as a state dictionary, which `torch.load` reads.
pub fn write(path: &Path, tensors: &[NamedTensor]) -> Result<(), Failure> {
    let bytes = archive(tensors).map_err(Failure::work)?;
    write_atomically(path, |out| out.write_all(&bytes)).map_err(Failure::work)
}

fn archive(tensors: &[NamedTensor]) -> io::Result<Vec<u8>> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    // PyTorch maps them into memory.
    let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
    let mut add = |name: String, bytes: &[u8]| {
        archive.start_file(format!("model/{name}"), stored)?;
        archive.write_all(bytes)
    };
    let shapes = tensors
        .iter()
        .map(|(name, shape, _)| (name.as_str(), shape.as_slice()));
    add(String::from("data.pkl"), &pickle::state_dictionary(shapes))?;
    add(String::from("byteorder"), b"little")?;
    for (key, (_, _, bytes)) in tensors.iter().enumerate() {
        add(format!("data/{key}"), bytes)?;
    }
    add(String::from("version"), b"3\n")?;
    Ok(archive.finish()?.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some() -> Vec<NamedTensor> {
        let bytes = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect();
        vec![
            (
                "a.weight".into(),
                vec![2, 3, 1],
                bytes(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
            ),
            ("a.bias".into(), vec![300], bytes(&[0.5; 300])),
        ]
    }

    #[test]
    fn what_is_written_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.pth");
        write(&path, &some()).unwrap();
        assert!(read(&path).unwrap() == some());
    }

    #[test]
    fn damaged_files_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.pth");
        let whole = archive(&some()).unwrap();
        for length in (0..whole.len()).step_by(7) {
            std::fs::write(&path, &whole[..length]).unwrap();
            assert!(read(&path).is_err(), "{length}");
        }
        // Whatever a changed byte makes of it, there is no panic.
        for at in 0..whole.len().min(700) {
            for change in [1, 0x80] {
                let mut bytes = whole.clone();
                bytes[at] ^= change;
                std::fs::write(&path, bytes).unwrap();
                let _ = read(&path);
            }
        }
    }

    /// Pickles that would fill the memory or the stack.
    #[test]
    fn bombs_are_refused() {
        let copies = [&b"\x80\x02)q\0"[..], &b"h\0h\0\x86q\0".repeat(60), b"."].concat();
        let deep = [&b"\x80\x02)"[..], &b"\x85".repeat(1_000_000), b"."].concat();
        let dictionaries = [&b"\x80\x02"[..], &b"}X\x01\0\0\0a".repeat(200_000)].concat();
        let dictionaries = [
            dictionaries,
            b"}".to_vec(),
            b"s".repeat(200_000),
            b".".to_vec(),
        ]
        .concat();
        for bomb in [copies, deep, dictionaries] {
            assert!(pickle::tensors(&bomb).is_err());
        }
    }

    #[test]
    fn values_are_taken_by_their_strides() {
        let storage: Vec<u8> = (0..6_u8).flat_map(|v| f32::from(v).to_le_bytes()).collect();
        let tensor = Tensor {
            storage: String::from("0"),
            number: pickle::Number::F32,
            offset: 1,
            shape: vec![2, 2],
            strides: vec![1, 2],
        };
        assert_eq!(values(&tensor, &storage), Some(vec![1.0, 3.0, 2.0, 4.0]));
        for (offset, stride) in [(3, 2), (usize::MAX, 2), (0, usize::MAX)] {
            let outside = Tensor {
                offset,
                strides: vec![stride, stride],
                ..tensor.clone()
            };
            assert_eq!(values(&outside, &storage), None);
        }
    }

    /// PyTorch's own files, where they are.
    #[test]
    fn state_dictionaries_of_pytorch_are_read() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/reference");
        for name in ["small", "full"] {
            let path = folder.join(name).with_extension("pth");
            if !path.exists() {
                eprintln!("skipped: there is no {}", path.display());
                continue;
            }
            let bytes = std::fs::read(path.with_extension("safetensors")).unwrap();
            let expected = safetensors::SafeTensors::deserialize(&bytes).unwrap();
            let tensors = read(&path).unwrap();
            let parameters = expected
                .names()
                .into_iter()
                .filter(|n| n.starts_with("param."));
            assert_eq!(tensors.len(), parameters.count());
            for (name, shape, bytes) in tensors {
                let expected = expected.tensor(&format!("param.{name}")).unwrap();
                assert!(
                    expected.shape() == shape && expected.data() == bytes,
                    "{name}"
                );
            }
        }
    }
}
