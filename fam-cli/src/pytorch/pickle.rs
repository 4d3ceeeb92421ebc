//! The part of Python's pickle format that state dictionaries need. Nothing that a pickle names is run.

use std::collections::HashMap;

/// Deepest nesting that is kept; a state dictionary in a checkpoint has three levels.
const DEEPEST: usize = 8;

/// Most items of a tuple that the memo keeps: those of storages and shapes have fewer.
const LONGEST: usize = 16;

/// What a pickle says of a tensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Tensor {
    /// Where its numbers are.
    pub storage: String,
    pub number: Number,
    /// In numbers, as the strides.
    pub offset: usize,
    pub shape: Vec<usize>,
    pub strides: Vec<usize>,
}

/// The kind of a tensor's numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Number {
    F32,
    F64,
}

impl Number {
    /// In bytes.
    pub fn size(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// One of them, from as many bytes.
    pub fn read(self, bytes: &[u8]) -> f32 {
        let number = match self {
            Self::F32 => bytes.first_chunk().map(|bytes| f32::from_le_bytes(*bytes)),
            Self::F64 => bytes
                .first_chunk()
                .map(|bytes| f64::from_le_bytes(*bytes) as f32),
        };
        number.unwrap_or(f32::NAN)
    }
}

#[derive(Debug, Clone)]
enum Value {
    Mark,
    /// Of which nothing is needed.
    Other,
    Int(i64),
    Text(String),
    /// A class or a function: its module and its name.
    Global(String),
    Tuple(Vec<Value>),
    Dictionary(Vec<(Value, Value)>),
    Storage(String, Option<Number>),
    Tensor(Tensor),
}

impl Value {
    /// Whether it has others in it.
    fn is_nested(&self) -> bool {
        matches!(self, Self::Tuple(_) | Self::Dictionary(_))
    }

    /// How many levels of others it has in it. None is built with more than [`DEEPEST`].
    fn depth(&self) -> usize {
        let deepest = match self {
            Self::Tuple(items) => items.iter().map(Self::depth).max(),
            Self::Dictionary(items) => items.iter().map(|(_, value)| value.depth()).max(),
            _ => return 0,
        };
        1 + deepest.unwrap_or(0)
    }
}

/// A tuple, unless it is nested too deeply to be of use.
fn tuple(items: Vec<Value>) -> Value {
    match items.iter().all(|item| item.depth() < DEEPEST) {
        true => Value::Tuple(items),
        false => Value::Other,
    }
}

/// The tensors of a pickle, in its order, with the keys of dictionaries that lead to them, joined by dots.
pub fn tensors(pickle: &[u8]) -> Result<Vec<(String, Tensor)>, String> {
    let damaged = || String::from("its data.pkl is damaged, or no state dictionary");
    let top = Machine {
        bytes: pickle,
        stack: Vec::new(),
        memo: HashMap::new(),
    };
    let mut found = Vec::new();
    collect(top.run().ok_or_else(damaged)?, "", &mut found);
    match found.is_empty() {
        true => Err(String::from("it holds no tensors of 32 or 64-bit floats")),
        false => Ok(found),
    }
}

fn collect(value: Value, name: &str, found: &mut Vec<(String, Tensor)>) {
    match value {
        Value::Tensor(tensor) => found.push((name.to_owned(), tensor)),
        Value::Dictionary(items) => {
            for (key, value) in items {
                let Value::Text(key) = key else {
                    continue;
                };
                let name = match name {
                    "" => key,
                    _ => format!("{name}.{key}"),
                };
                collect(value, &name, found);
            }
        }
        _ => {}
    }
}

/// Reads opcodes. Every function gives none where the pickle is damaged.
struct Machine<'a> {
    bytes: &'a [u8],
    stack: Vec<Value>,
    memo: HashMap<u32, Value>,
}

impl Machine<'_> {
    fn run(mut self) -> Option<Value> {
        loop {
            let [opcode] = self.take()?;
            match opcode {
                b'.' => return self.stack.pop(),
                // The protocol, and the length of what follows.
                0x80 => drop(self.take::<1>()?),
                0x95 => drop(self.take::<8>()?),
                b'(' => self.stack.push(Value::Mark),
                b'c' => {
                    let (module, name) = (self.line()?, self.line()?);
                    self.stack.push(Value::Global(format!("{module}.{name}")));
                }
                0x93 => {
                    let (Value::Text(name), Value::Text(module)) = (self.pop()?, self.pop()?)
                    else {
                        return None;
                    };
                    self.stack.push(Value::Global(format!("{module}.{name}")));
                }
                b'q' => self.remember(u32::from(self.bytes.first().copied()?), 1)?,
                b'r' => {
                    let place = u32::from_le_bytes(*self.bytes.first_chunk()?);
                    self.remember(place, 4)?;
                }
                0x94 => self.remember(self.memo.len() as u32, 0)?,
                b'h' => {
                    let [place] = self.take()?;
                    self.recall(u32::from(place))?;
                }
                b'j' => {
                    let place = u32::from_le_bytes(self.take()?);
                    self.recall(place)?;
                }
                b'X' => {
                    let length = u32::from_le_bytes(self.take()?);
                    self.text(length as usize)?;
                }
                0x8c => {
                    let [length] = self.take()?;
                    self.text(usize::from(length))?;
                }
                b'K' => {
                    let [value] = self.take()?;
                    self.stack.push(Value::Int(i64::from(value)));
                }
                b'M' => {
                    let value = u16::from_le_bytes(self.take()?);
                    self.stack.push(Value::Int(i64::from(value)));
                }
                b'J' => {
                    let value = i32::from_le_bytes(self.take()?);
                    self.stack.push(Value::Int(i64::from(value)));
                }
                0x8a => self.long()?,
                b'G' => {
                    self.take::<8>()?;
                    self.stack.push(Value::Other);
                }
                b'N' | 0x88 | 0x89 | b']' => self.stack.push(Value::Other),
                b')' => self.stack.push(Value::Tuple(Vec::new())),
                b't' => {
                    let items = self.since_mark()?;
                    self.stack.push(tuple(items));
                }
                0x85..=0x87 => {
                    let count = usize::from(opcode - 0x84);
                    let first = self.stack.len().checked_sub(count)?;
                    let items = self.stack.split_off(first);
                    self.stack.push(tuple(items));
                }
                b'}' => self.stack.push(Value::Dictionary(Vec::new())),
                b's' => {
                    let (value, key) = (self.pop()?, self.pop()?);
                    self.set(vec![key, value])?;
                }
                b'u' => {
                    let items = self.since_mark()?;
                    self.set(items)?;
                }
                b'a' => drop(self.pop()?),
                b'e' => drop(self.since_mark()?),
                // The state of an object, such as the versions of a state dictionary.
                b'b' => drop(self.pop()?),
                b'Q' => {
                    let storage = self.pop()?;
                    self.stack.push(storage_of(storage)?);
                }
                // An object, of which only dictionaries could be of use.
                0x81 => {
                    self.pop()?;
                    self.pop()?;
                    self.stack.push(Value::Other);
                }
                b'R' => {
                    let (arguments, function) = (self.pop()?, self.pop()?);
                    self.stack.push(called(function, arguments)?);
                }
                _ => return None,
            }
        }
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.bytes.split_first_chunk()?;
        self.bytes = rest;
        Some(*first)
    }

    fn pop(&mut self) -> Option<Value> {
        self.stack.pop()
    }

    fn line(&mut self) -> Option<String> {
        let end = self.bytes.iter().position(|byte| *byte == b'\n')?;
        let line = str::from_utf8(&self.bytes[..end]).ok()?.to_owned();
        self.bytes = &self.bytes[end + 1..];
        Some(line)
    }

    fn text(&mut self, length: usize) -> Option<()> {
        let (text, rest) = self.bytes.split_at_checked(length)?;
        let text = str::from_utf8(text).ok()?.to_owned();
        self.bytes = rest;
        self.stack.push(Value::Text(text));
        Some(())
    }

    /// A number of up to eight bytes.
    fn long(&mut self) -> Option<()> {
        let [length] = self.take()?;
        let (digits, rest) = self.bytes.split_at_checked(usize::from(length))?;
        self.bytes = rest;
        let is_negative = digits.last().is_some_and(|byte| *byte >= 0x80);
        let mut bytes = [if is_negative { 0xff } else { 0 }; 8];
        bytes.get_mut(..digits.len())?.copy_from_slice(digits);
        self.stack.push(Value::Int(i64::from_le_bytes(bytes)));
        Some(())
    }

    /// Keeps the top of the stack at a place, which so many bytes name.
    fn remember(&mut self, place: u32, bytes: usize) -> Option<()> {
        self.bytes = self.bytes.get(bytes..)?;
        // Dictionaries are filled later, and asked for no more. Nothing that is large is kept, or what
        // recalls it again and again would fill the memory.
        let value = match self.stack.last()? {
            Value::Dictionary(_) => Value::Other,
            Value::Tuple(items) if items.len() > LONGEST || items.iter().any(Value::is_nested) => {
                Value::Other
            }
            value => value.clone(),
        };
        self.memo.insert(place, value);
        Some(())
    }

    fn recall(&mut self, place: u32) -> Option<()> {
        self.stack.push(self.memo.get(&place)?.clone());
        Some(())
    }

    fn since_mark(&mut self) -> Option<Vec<Value>> {
        let mark = self
            .stack
            .iter()
            .rposition(|value| matches!(value, Value::Mark))?;
        let items = self.stack.split_off(mark + 1);
        self.stack.pop();
        Some(items)
    }

    fn set(&mut self, items: Vec<Value>) -> Option<()> {
        if let Value::Dictionary(dictionary) = self.stack.last_mut()? {
            let mut items = items.into_iter();
            while let (Some(key), Some(value)) = (items.next(), items.next()) {
                if value.depth() < DEEPEST {
                    dictionary.push((key, value));
                }
            }
        }
        Some(())
    }
}

/// The storage that a persistent identity names.
fn storage_of(value: Value) -> Option<Value> {
    let Value::Tuple(parts) = value else {
        return None;
    };
    match &parts[..] {
        [_, Value::Global(class), Value::Text(key), ..] => {
            let number = match class.as_str() {
                "torch.FloatStorage" => Some(Number::F32),
                "torch.DoubleStorage" => Some(Number::F64),
                _ => None,
            };
            Some(Value::Storage(key.clone(), number))
        }
        _ => None,
    }
}

/// What a call gives; of a function that is not known, something of which nothing is needed.
fn called(function: Value, arguments: Value) -> Option<Value> {
    let (Value::Global(function), Value::Tuple(mut arguments)) = (function, arguments) else {
        return Some(Value::Other);
    };
    Some(match function.as_str() {
        "collections.OrderedDict" => Value::Dictionary(Vec::new()),
        "torch._utils._rebuild_parameter" if !arguments.is_empty() => arguments.swap_remove(0),
        "torch._utils._rebuild_tensor_v2" => match &arguments[..] {
            [
                Value::Storage(storage, Some(number)),
                Value::Int(offset),
                Value::Tuple(shape),
                Value::Tuple(strides),
                ..,
            ] if shape.len() == strides.len() => Value::Tensor(Tensor {
                storage: storage.clone(),
                number: *number,
                offset: usize::try_from(*offset).ok()?,
                shape: sizes(shape)?,
                strides: sizes(strides)?,
            }),
            _ => Value::Other,
        },
        _ => Value::Other,
    })
}

fn sizes(values: &[Value]) -> Option<Vec<usize>> {
    let size = |value: &Value| match value {
        Value::Int(size) => usize::try_from(*size).ok(),
        _ => None,
    };
    values.iter().map(size).collect()
}

/// The pickle of a state dictionary: names and shapes, the numbers of each in a storage of its own.
pub fn state_dictionary<'a>(tensors: impl Iterator<Item = (&'a str, &'a [usize])>) -> Vec<u8> {
    const EMPTY: &[u8] = b"ccollections\nOrderedDict\n)R";
    let mut out = vec![0x80, 2];
    out.extend(EMPTY);
    out.push(b'(');
    for (key, (name, shape)) in tensors.enumerate() {
        text(&mut out, name);
        out.extend(b"ctorch._utils\n_rebuild_tensor_v2\n((");
        text(&mut out, "storage");
        out.extend(b"ctorch\nFloatStorage\n");
        text(&mut out, &key.to_string());
        text(&mut out, "cpu");
        int(&mut out, shape.iter().product());
        out.extend(b"tQK\0");
        let mut strides = vec![1; shape.len()];
        for axis in (1..shape.len()).rev() {
            strides[axis - 1] = strides[axis] * shape[axis];
        }
        for sizes in [shape, &strides] {
            out.push(b'(');
            sizes.iter().for_each(|&size| int(&mut out, size));
            out.push(b't');
        }
        // No gradient, and no hooks.
        out.push(0x89);
        out.extend(EMPTY);
        out.extend(b"tR");
    }
    out.extend(b"u.");
    out
}

fn text(out: &mut Vec<u8>, text: &str) {
    out.push(b'X');
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(text.as_bytes());
}

fn int(out: &mut Vec<u8>, value: usize) {
    out.push(b'J');
    out.extend((value as i32).to_le_bytes());
}
