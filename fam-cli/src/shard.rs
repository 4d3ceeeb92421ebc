//! One of several equal shares of the files, for machines that work side by side.

use std::str::FromStr;

/// Shard `number` of `count`, counted from 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shard {
    number: usize,
    count: usize,
}

impl Shard {
    /// The shard of this task of a Slurm array, from the variables that Slurm sets.
    fn of_slurm(variable: impl Fn(&str) -> Option<String>) -> Result<Self, String> {
        let read = |name: &str| -> Result<usize, String> {
            let name = format!("SLURM_ARRAY_TASK_{name}");
            let text = variable(&name).ok_or_else(|| {
                format!("{name} is not set; `slurm` is for the tasks of a Slurm array")
            })?;
            let number = text.parse();
            number.map_err(|_| format!("{name} is not a number: {text}"))
        };
        let (task, first, last, count) = (read("ID")?, read("MIN")?, read("MAX")?, read("COUNT")?);
        let gaps = count == 0 || !(first..=last).contains(&task) || last - first != count - 1;
        if gaps {
            return Err(format!(
                "tasks {first} to {last} of the Slurm array are not {count} in a row; \
                 name the shard as K/N"
            ));
        }
        Ok(Self {
            number: task - first + 1,
            count,
        })
    }

    /// Every N-th of some items, beginning with the K-th. Shards of the same items have none in
    /// common, and together they have all.
    pub fn of<T>(&self, items: Vec<T>) -> Vec<T> {
        let mine = |(index, item)| (index % self.count == self.number - 1).then_some(item);
        items.into_iter().enumerate().filter_map(mine).collect()
    }

    /// The name of its manifest: shards may write into one folder at the same time.
    pub fn manifest(&self) -> String {
        format!("manifest-{}-of-{}.jsonl", self.number, self.count)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "slurm" {
            return Self::of_slurm(|name| std::env::var(name).ok());
        }
        let numbers = text.split_once('/');
        let numbers = numbers.and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
        match numbers {
            Some((number, count)) if (1..=count).contains(&number) => Ok(Self { number, count }),
            _ => Err("a shard is K/N, from 1/N to N/N, or `slurm`".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_have_every_item_once() {
        for (items, count) in [(10, 3), (2, 5), (0, 4), (7, 1)] {
            let mut all: Vec<usize> = (1..=count)
                .flat_map(|number| Shard { number, count }.of((0..items).collect()))
                .collect();
            all.sort_unstable();
            assert_eq!(all, (0..items).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_shard_is_named_or_that_of_the_slurm_task() {
        assert_eq!(
            "2/3".parse(),
            Ok(Shard {
                number: 2,
                count: 3
            })
        );
        for text in ["0/3", "4/3", "1/0", "2", "a/b", "-1/3", ""] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
        let slurm = |values: [&str; 4]| {
            let values = values.map(str::to_owned);
            Shard::of_slurm(move |name| {
                let names = ["ID", "MIN", "MAX", "COUNT"];
                let at = names.iter().position(|end| name.ends_with(end))?;
                Some(values[at].clone()).filter(|value| !value.is_empty())
            })
        };
        assert_eq!(
            slurm(["7", "5", "9", "5"]),
            Ok(Shard {
                number: 3,
                count: 5
            })
        );
        for values in [
            ["7", "3", "7", "2"],
            ["2", "3", "7", "5"],
            ["x", "3", "7", "5"],
            ["", "3", "7", "5"],
            ["3", "3", "3", "0"],
        ] {
            assert!(slurm(values).is_err(), "{values:?}");
        }
    }
}
