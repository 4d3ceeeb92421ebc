#![no_main]

use fam_io::Format;
use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};

const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;

fuzz_target!(|bytes: &[u8]| {
    fam_fuzz::check(Format::Glb, bytes);
});

// Most changes of the length of a chunk make a container that is refused at once. Three times
// in four the content of a chunk is changed, and the lengths with it.
fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    let Some(mut chunks) = chunks(&data[..size]).filter(|_| !seed.is_multiple_of(4)) else {
        return fuzzer_mutate(data, size, max_size);
    };
    let others: usize = chunks
        .iter()
        .map(|chunk| CHUNK_HEADER + chunk.content.len())
        .sum();
    let which = seed as usize / 4 % chunks.len();
    let content = &mut chunks[which].content;
    let old = content.len();
    let room = max_size.saturating_sub(HEADER + others).min(64);
    content.resize(old + room, 0);
    let new = fuzzer_mutate(content, old, old + room);
    content.truncate(new);
    let bytes = container(&chunks);
    data[..bytes.len()].copy_from_slice(&bytes);
    bytes.len()
});

struct Chunk {
    kind: [u8; 4],
    content: Vec<u8>,
}

/// The chunks of a GLB of at least one, all of which are whole.
fn chunks(bytes: &[u8]) -> Option<Vec<Chunk>> {
    let mut rest = bytes.strip_prefix(b"glTF\x02\0\0\0")?.get(4..)?;
    let mut chunks = Vec::new();
    while let Some((length, kind_and_content)) = rest.split_first_chunk() {
        let (kind, content) = kind_and_content.split_first_chunk()?;
        let (content, next) = content.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        chunks.push(Chunk {
            kind: *kind,
            content: content.to_vec(),
        });
        rest = next;
    }
    (!chunks.is_empty()).then_some(chunks)
}

fn container(chunks: &[Chunk]) -> Vec<u8> {
    let mut bytes = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for chunk in chunks {
        bytes.extend((chunk.content.len() as u32).to_le_bytes());
        bytes.extend(chunk.kind);
        bytes.extend(&chunk.content);
    }
    let length = bytes.len() as u32;
    bytes[8..HEADER].copy_from_slice(&length.to_le_bytes());
    bytes
}
