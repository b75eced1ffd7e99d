//! The threads of one detector, and a way into them that does not allocate.
//!
//! Entering a rayon pool from outside (`install`, `spawn`) queues a job on the heap. So one job is queued once: the
//! driver, which waits on a condition variable for the caller's closure and runs it inside the pool, where `join` keeps
//! its jobs on the stack.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use crate::error::ParamError;
use crate::row::bands::Bands;
use crate::row::machine::{Machine, SimdLevel};

/// A closure of the caller, which waits until it has run.
struct Job(*mut (dyn FnMut() + Send));

// SAFETY: the closure behind the pointer is `Send`, and `Pool::run` keeps it alive and untouched until the driver is done.
#[allow(unsafe_code)]
unsafe impl Send for Job {}

enum State {
    Idle,
    Ready(Job),
    Running,
    Done(Option<Box<dyn Any + Send>>),
    Quit,
}

struct Door {
    state: Mutex<State>,
    changed: Condvar,
}

impl Door {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait<'a>(&self, state: MutexGuard<'a, State>) -> MutexGuard<'a, State> {
        self.changed.wait(state).unwrap_or_else(PoisonError::into_inner)
    }

    fn drive(&self) {
        loop {
            let mut state = self.lock();
            let job = loop {
                match std::mem::replace(&mut *state, State::Running) {
                    State::Ready(job) => break job,
                    State::Quit => return,
                    other => {
                        *state = other;
                        state = self.wait(state);
                    }
                }
            };
            drop(state);
            let outcome = catch_unwind(AssertUnwindSafe(|| {
                // SAFETY: `Pool::run` wrote this pointer to a closure of its own frame and does not leave that frame
                // before it sees `Done`, which is set below, after the call.
                #[allow(unsafe_code)]
                unsafe {
                    (*job.0)()
                }
            }));
            *self.lock() = State::Done(outcome.err());
            self.changed.notify_all();
        }
    }
}

struct Pool {
    door: Arc<Door>,
    /// Where the threads were started: after a fork they are not in the child.
    process: u32,
    _threads: rayon::ThreadPool,
}

impl Pool {
    fn new(threads: usize) -> Result<Self, rayon::ThreadPoolBuildError> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|index| format!("apgstmd-{index}"))
            .build()?;
        // Threads allocate while they start; from here on they are up.
        pool.broadcast(|_| ());
        let door = Arc::new(Door { state: Mutex::new(State::Idle), changed: Condvar::new() });
        let inside = Arc::clone(&door);
        pool.spawn(move || inside.drive());
        Ok(Self { door, process: std::process::id(), _threads: pool })
    }

    fn run(&mut self, closure: &mut (dyn FnMut() + Send)) {
        let pointer = std::ptr::from_mut(closure);
        // SAFETY: only the lifetime changes; the pointer is used by the driver alone and only before `Done`.
        #[allow(unsafe_code)]
        let pointer = unsafe {
            std::mem::transmute::<*mut (dyn FnMut() + Send + '_), *mut (dyn FnMut() + Send + 'static)>(pointer)
        };
        let mut state = self.door.lock();
        *state = State::Ready(Job(pointer));
        self.door.changed.notify_all();
        let outcome = loop {
            state = self.door.wait(state);
            match std::mem::replace(&mut *state, State::Idle) {
                State::Done(outcome) => break outcome,
                other => *state = other,
            }
        };
        drop(state);
        if let Some(payload) = outcome {
            resume_unwind(payload);
        }
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        *self.door.lock() = State::Quit;
        self.door.changed.notify_all();
    }
}

/// The threads of one detector: none of their own for 1, a rayon pool for more.
pub(crate) struct Workers {
    threads: usize,
    simd: SimdLevel,
    dense: bool,
    pool: Option<Pool>,
}

impl Workers {
    pub fn new(machine: &Machine) -> Result<Self, ParamError> {
        let threads = machine.threads;
        if !(1..=crate::MOST_THREADS).contains(&threads) {
            return Err(ParamError::Threads { threads, most: crate::MOST_THREADS });
        }
        let pool = if threads == 1 {
            None
        } else {
            let pool = Pool::new(threads);
            Some(pool.map_err(|error| ParamError::ThreadStart { threads, reason: error.to_string() })?)
        };
        Ok(Self { threads, simd: machine.level(), dense: machine.dense, pool })
    }

    pub fn threads(&self) -> usize {
        self.threads
    }

    pub fn simd(&self) -> SimdLevel {
        self.simd
    }

    /// Runs `work` with the machine: inside the pool, or on the calling thread where there is none.
    pub fn run<R: Send>(&mut self, work: impl FnOnce(&Bands) -> R + Send) -> R {
        if self.pool.as_ref().is_some_and(|pool| pool.process != std::process::id()) {
            // A forked child: the old threads do not exist here, so neither can their pool be dropped.
            std::mem::forget(std::mem::replace(&mut self.pool, Pool::new(self.threads).ok()));
        }
        let bands = Bands::new(if self.pool.is_some() { self.threads } else { 1 }, self.simd, self.dense);
        match &mut self.pool {
            None => work(&bands),
            Some(pool) => {
                let mut work = Some(work);
                let mut result = None;
                pool.run(&mut || result = work.take().map(|work| work(&bands)));
                result.expect("the driver ran the closure")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_inside_the_pool_and_returns() {
        for threads in [1, 2, 5] {
            let mut workers = Workers::new(&Machine::with_threads(threads)).unwrap();
            for round in 0..100 {
                let seen = workers.run(|bands| {
                    assert_eq!(bands.threads(), threads);
                    if threads > 1 {
                        assert_eq!(rayon::current_num_threads(), threads);
                    }
                    round
                });
                assert_eq!(seen, round);
            }
        }
    }

    #[test]
    fn a_panic_reaches_the_caller_and_the_workers_live_on() {
        let mut workers = Workers::new(&Machine::with_threads(2)).unwrap();
        let caught = catch_unwind(AssertUnwindSafe(|| workers.run(|_| panic!("on purpose"))));
        assert_eq!(*caught.unwrap_err().downcast::<&str>().unwrap(), "on purpose");
        assert_eq!(workers.run(|_| 7), 7);
    }

    #[test]
    fn thread_counts_are_checked() {
        assert!(matches!(Workers::new(&Machine::with_threads(0)), Err(ParamError::Threads { threads: 0, .. })));
        assert!(Workers::new(&Machine::with_threads(100_000)).is_err());
    }
}
