//! Placeholder.
use crate::error::ParamError;
pub(crate) struct Workers {
    threads: usize,
}
pub(crate) struct Bands<'a>(&'a ());
impl Workers {
    pub fn new(threads: usize) -> Result<Self, ParamError> {
        if !(1..=crate::MOST_THREADS).contains(&threads) {
            return Err(ParamError::Threads { threads, most: crate::MOST_THREADS });
        }
        Ok(Self { threads })
    }
    pub fn threads(&self) -> usize {
        self.threads
    }
    pub fn run(&self, f: impl FnOnce(&Bands<'_>) + Send) {
        f(&Bands(&()));
    }
}
