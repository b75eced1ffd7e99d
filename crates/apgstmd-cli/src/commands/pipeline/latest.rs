//! `--live`: a place for one frame. What is still there when the next one comes is dropped, so that the one taken is
//! always the newest.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::ahead::Read;
use crate::interrupt;

#[derive(Default)]
pub(super) struct Latest {
    place: Mutex<Place>,
    changed: Condvar,
}

#[derive(Default)]
struct Place {
    newest: Option<Read>,
    dropped: usize,
    /// No more will come.
    ended: bool,
    /// Nobody will take any.
    closed: bool,
}

impl Latest {
    /// Puts a frame there; false when nobody wants more.
    pub fn put(&self, read: Read) -> bool {
        let mut place = self.lock();
        if place.newest.replace(read).is_some() {
            place.dropped += 1;
        }
        self.changed.notify_one();
        !place.closed
    }

    pub fn end(&self) {
        self.lock().ended = true;
        self.changed.notify_one();
    }

    pub fn close(&self) {
        self.lock().closed = true;
    }

    /// The newest, waited for; none at the end and when the user asks for it.
    pub fn take(&self) -> Option<Read> {
        const LOOK: Duration = Duration::from_millis(50);
        let mut place = self.lock();
        loop {
            if interrupt::asked() {
                return None;
            }
            if place.newest.is_some() || place.ended {
                return place.newest.take();
            }
            place = self.changed.wait_timeout(place, LOOK).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// How many nobody took.
    pub fn dropped(&self) -> usize {
        self.lock().dropped
    }

    fn lock(&self) -> MutexGuard<'_, Place> {
        self.place.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
