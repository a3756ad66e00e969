//! Seal of a class: signatures of its records, plans and kept runs, so that none counts that was edited or comes from
//! elsewhere.
//!
//! ```text
//! H = SHA-256, K = key, 64 bytes with zeros at the end
//! HMAC(K, m) = H((K ⊕ 5c…) ‖ H((K ⊕ 36…) ‖ m))                RFC 2104
//! ```
//!
//! The key is random, and a file in the folder of the results that only its owner may read. All shards share it.

use std::io::{self, ErrorKind, Read, Write};
use std::path::Path;

use sha2::{Digest, Sha256};
use tempfile::NamedTempFile;

use crate::boundary::door::{DoorError, open_regular};

/// Name of the key's file.
const FILE: &str = "records.key";

/// Text around the signature and the record.
const START: &str = "{\n\"hmac\": \"";
const MIDDLE: &str = "\",\n\"record\": ";
const END: &str = "\n}\n";

/// Lines before the record.
pub(crate) const LINES_BEFORE: usize = 2;

/// Bytes of a block of SHA-256.
const BLOCK: usize = 64;

/// The key of a class.
#[derive(Debug, Clone)]
pub struct Seal([u8; 32]);

/// A number that students do not know.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Secret(pub u64);

impl Secret {
    /// The number of one run, which no file holds.
    ///
    /// # Errors
    /// If the system has no random numbers.
    pub fn random() -> io::Result<Self> {
        Ok(Seal::unkept()?.secret())
    }
}

impl Seal {
    /// The key in a folder of results, which is made if there is none.
    ///
    /// # Errors
    /// If it can neither be read nor made.
    pub fn of(results: &Path) -> io::Result<Self> {
        let path = results.join(FILE);
        match Self::read(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            found => return found,
        }
        let Self(key) = Self::unkept()?;
        // It appears whole, with mode 600, and once: another shard may make one at the same time.
        let mut file = NamedTempFile::new_in(results)?;
        file.write_all(&key)?;
        file.as_file().sync_all()?;
        match file.persist_noclobber(&path) {
            Err(failed) if failed.error.kind() != ErrorKind::AlreadyExists => Err(failed.error),
            _ => Self::read(&path),
        }
    }

    /// A key for one run, which no file holds.
    ///
    /// # Errors
    /// If the system has no random numbers.
    fn unkept() -> io::Result<Self> {
        let mut key = [0; 32];
        getrandom::fill(&mut key).map_err(io::Error::other)?;
        Ok(Self(key))
    }

    /// The number that altered copies are drawn from.
    pub fn secret(&self) -> Secret {
        let [a, b, c, d, e, f, g, h, ..] = hmac(&self.0, &[b"altered copies"]);
        Secret(u64::from_le_bytes([a, b, c, d, e, f, g, h]))
    }

    /// The key in a folder of results, which has one.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn existing(results: &Path) -> io::Result<Self> {
        Self::read(&results.join(FILE))
    }

    fn read(path: &Path) -> io::Result<Self> {
        let file = open_regular(path).map_err(|error| match error {
            DoorError::Unreadable(error) => error,
            error => io::Error::other(error),
        })?;
        let mut key = Vec::new();
        file.take(33).read_to_end(&mut key)?;
        let damaged = "is not a key of records\n  help: remove it, and grade again";
        key.try_into().map(Self).map_err(|_| io::Error::other(damaged))
    }

    /// A JSON record with its signature, which is of this name and of the record's very bytes.
    pub fn wrap(&self, name: &str, record: &str) -> String {
        format!("{START}{}{MIDDLE}{record}{END}", self.sign(name, record))
    }

    /// The record in a text that [`wrap`](Self::wrap) made for this name; `None` if the text is not such a one.
    pub(crate) fn unwrap<'a>(&self, name: &str, text: &'a str) -> Option<&'a str> {
        let signed = text.strip_prefix(START).and_then(|text| text.strip_suffix(END));
        let (signature, record) = signed.and_then(|text| text.split_once(MIDDLE))?;
        (self.sign(name, record) == signature).then_some(record)
    }

    /// The signature of a record of this name, in hexadecimal. Names of different kinds have different first lines.
    pub(crate) fn sign(&self, name: &str, record: &str) -> String {
        hexadecimal(&hmac(&self.0, &[name.as_bytes(), b"\0", record.as_bytes()]))
    }
}

/// Bytes in hexadecimal.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// HMAC of a message in parts, with a key of at most a block.
fn hmac(key: &[u8], message: &[&[u8]]) -> [u8; 32] {
    let padded = |pad: u8| {
        let mut block = [pad; BLOCK];
        block.iter_mut().zip(key).for_each(|(byte, key)| *byte ^= key);
        Sha256::new().chain_update(block)
    };
    let inner = message.iter().fold(padded(0x36), |hash, part| hash.chain_update(part));
    padded(0x5c).chain_update(inner.finalize()).finalize().into()
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    /// The first two cases of RFC 4231.
    #[test]
    fn signatures_match_the_standards_test_vectors() {
        for (key, message, expected) in [
            (
                &[0x0b; 20][..],
                &[&b"Hi "[..], b"There"],
                "b0344c61d8db38535ca8afceaf0bf12b881dc200c9833da726e9376c2e32cff7",
            ),
            (
                b"Jefe",
                &[&b"what do ya want "[..], b"for nothing?"],
                "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843",
            ),
        ] {
            assert_eq!(hexadecimal(&hmac(key, message)), expected);
        }
    }

    #[test]
    fn the_key_is_made_once_for_its_owner_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(FILE);
        let key = Seal::of(folder.path()).unwrap().0;
        assert_eq!(Seal::of(folder.path()).unwrap().0, key);
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        let other = tempfile::tempdir().unwrap();
        assert_ne!(Seal::of(other.path()).unwrap().0, key);
        // A key of someone else's choice is not followed to.
        fs::remove_file(&path).unwrap();
        std::os::unix::fs::symlink(other.path().join(FILE), &path).unwrap();
        assert!(Seal::of(folder.path()).is_err());
        fs::remove_file(&path).unwrap();
        fs::write(&path, "short").unwrap();
        assert!(Seal::of(folder.path()).unwrap_err().to_string().contains("help:"));
    }
}
