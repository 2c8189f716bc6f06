//! A serial line: one request at a time, and answers that are whose they seem.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::time::{Instant, timeout};
use tokio_modbus::client::{Client, rtu};
use tokio_modbus::prelude::Slave;

use crate::connection::{LinkFault, Reply, checked, fault, request};
use crate::late::{LateAnswers, Shape};
use crate::plan::Block;
use crate::port::{Noise, Port};
use crate::transport::SerialLine;

/// Bytes of a request and of an answer without its data (Modbus over Serial Line
/// V1.02, 2.5.1).
const OVERHEAD_BYTES: u32 = 8 + 5;
/// Requests that one read may take: to get back into step, and once more when
/// another answer came.
const MAX_EXCHANGES: usize = 4;

const PORT_GONE: &str = "the port is gone; is it unplugged?";

/// Record of late answers, which outlives the opening of a port.
pub(crate) type SharedLate = Arc<Mutex<LateAnswers>>;

pub(crate) struct Bus {
    port: Port,
    line: SerialLine,
    /// Deadline of an answer, beside the time on the line.
    limit: Duration,
    late: SharedLate,
}

impl Bus {
    pub(crate) fn open(
        line: &SerialLine,
        limit: Duration,
        late: SharedLate,
    ) -> Result<Self, LinkFault> {
        let port = Port::open(line).map_err(LinkFault::Port)?;
        Ok(Self { port, line: line.clone(), limit, late })
    }

    /// Reads a block. A device that does not answer is no error here.
    ///
    /// # Errors
    /// When the port is gone, or the line does not fall silent.
    pub(crate) async fn read(&mut self, block: &Block) -> Result<Reply, LinkFault> {
        for left in (0..MAX_EXCHANGES).rev() {
            let asked = self.late().unmistakable(block);
            match self.exchange(&asked).await? {
                // Not the device's, or garbled: it may well answer now.
                Reply::None(LinkFault::Answer { .. }) if left > 0 => {}
                reply @ Reply::None(_) => return Ok(reply),
                reply if asked == *block => return Ok(reply),
                // Only to get back into step.
                _ => {}
            }
        }
        Ok(Reply::None(LinkFault::OutOfStep(block.unit)))
    }

    async fn exchange(&mut self, block: &Block) -> Result<Reply, LinkFault> {
        self.fall_silent(self.line.silence(), None).await?;
        self.late().note_request(block);
        // A client of its own, for no bytes of former answers to be left in it.
        let mut client = rtu::attach_slave(self.port.clone(), Slave(block.unit));
        let bytes = OVERHEAD_BYTES + u32::from(Shape::from_block(block).bytes);
        let limit = self.limit + self.line.transmission(bytes);
        let reply = match timeout(limit, client.call(request(block))).await {
            Ok(Ok(Ok(response))) => checked(block, response),
            Ok(Ok(Err(exception))) => {
                self.late().note_exception(block);
                return Ok(Reply::Exception(exception));
            }
            Ok(Err(error)) => Err(fault(block, &error)),
            Err(_) => Err(LinkFault::no_answer(block, self.limit)),
        };
        match reply {
            Ok(reply) => {
                self.late().note_answer(block);
                Ok(reply)
            }
            Err(LinkFault::Lost(_)) => Err(LinkFault::Lost(PORT_GONE.into())),
            Err(fault) => {
                // What is still to come shall not run into the next request.
                self.fall_silent(self.limit, Some(Instant::now())).await?;
                Ok(Reply::None(fault))
            }
        }
    }

    async fn fall_silent(
        &mut self,
        silence: Duration,
        start: Option<Instant>,
    ) -> Result<(), LinkFault> {
        let fell = self.port.fall_silent(silence, start).await;
        let fell = fell.map_err(|_| LinkFault::Lost(PORT_GONE.into()))?;
        fell.map_err(|Noise| LinkFault::Noise)
    }

    fn late(&self) -> MutexGuard<'_, LateAnswers> {
        self.late.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
