//! Files of stored results. Numbers marked with [`bits`] round-trip to the same bits, including infinities.

use std::io::{self, Write};
use std::path::Path;

use scene::output::OutputFile;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// The record in a file, if it is one.
pub(crate) fn load<T: DeserializeOwned>(path: &Path) -> Option<T> {
    serde_json::from_slice(&std::fs::read(path).ok()?).ok()
}

/// Writes a record to a file, as a whole or not at all.
///
/// # Errors
/// If the record or the file cannot be written.
pub(crate) fn save(path: &Path, record: &impl Serialize) -> io::Result<()> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let bytes = serde_json::to_vec(record)?;
    let mut file = OutputFile::create(path)?;
    file.write_all(&bytes)?;
    file.commit()
}

/// Numbers as their bits: `#[serde(with = "bits")]`.
pub(crate) mod bits {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(number: &f64, to: S) -> Result<S::Ok, S::Error> {
        number.to_bits().serialize(to)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
        u64::deserialize(from).map(f64::from_bits)
    }

    pub(crate) mod optional {
        use super::{Deserialize, Deserializer, Serialize, Serializer};

        pub(crate) fn serialize<S: Serializer>(
            number: &Option<f64>,
            to: S,
        ) -> Result<S::Ok, S::Error> {
            number.map(f64::to_bits).serialize(to)
        }

        pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
            from: D,
        ) -> Result<Option<f64>, D::Error> {
            Ok(Option::<u64>::deserialize(from)?.map(f64::from_bits))
        }
    }
}
