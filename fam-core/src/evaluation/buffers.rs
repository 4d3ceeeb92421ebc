use std::sync::Mutex;

/// More would be kept for nothing: a step holds one for each of its nine evaluations, and one for
/// each of its two Jacobians.
const MOST: usize = 16;

/// Buffers to be used again: those of one step have the sizes of the next, and the system need
/// not clear them anew.
#[derive(Debug, Default)]
pub(super) struct Buffers(Mutex<Vec<Vec<f32>>>);

impl Buffers {
    /// A buffer of a length, of any values: the smallest one that has room.
    pub(super) fn take(&self, length: usize) -> Vec<f32> {
        let mut kept = self.kept();
        let with_room = (0..kept.len()).filter(|&i| kept[i].capacity() >= length);
        match with_room.min_by_key(|&i| kept[i].capacity()) {
            Some(index) => {
                let mut buffer = kept.swap_remove(index);
                buffer.resize(length, 0.0);
                buffer
            }
            None => vec![0.0; length],
        }
    }

    /// Keeps a buffer, and no more than the latest few.
    pub(super) fn give_back(&self, buffer: Vec<f32>) {
        let mut kept = self.kept();
        kept.push(buffer);
        if kept.len() > MOST {
            kept.remove(0);
        }
    }

    fn kept(&self) -> std::sync::MutexGuard<'_, Vec<Vec<f32>>> {
        // A list of buffers is whole after any panic.
        self.0
            .lock()
            .unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}
