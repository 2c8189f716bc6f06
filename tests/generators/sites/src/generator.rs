//! Load generator: a connection for each station, messages at an even pace.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, ensure};
use bytes::BytesMut;
use rumqttc_v4::mqttbytes::QoS;
use rumqttc_v4::mqttbytes::v4::{Connect, Packet, Publish};

use crate::payload::{Outgoing, PayloadFormat};

/// Load that the generator publishes.
#[derive(clap::Args, Clone, Copy, Debug)]
pub(crate) struct Load {
    /// Port of the broker on this machine.
    #[arg(long)]
    pub(crate) port: u16,
    /// Payload format of messages.
    #[arg(long, value_enum)]
    pub(crate) form: PayloadFormat,
    /// Number of simulated stations.
    #[arg(long)]
    pub(crate) stations: u32,
    /// Number of points of a station.
    #[arg(long)]
    pub(crate) points: u32,
    /// Rate in points of all stations a second.
    #[arg(long)]
    pub(crate) rate: f64,
    /// Duration after the births, seconds.
    #[arg(long)]
    pub(crate) seconds: f64,
}

/// Publishes the load; prints the number of points and the seconds.
pub(crate) fn run(load: &Load) -> Result<(u64, f64)> {
    let connect = |station| Station::connect(load.port, station);
    let mut stations: Vec<_> = (0..load.stations).map(connect).collect::<Result<_>>()?;
    for (index, station) in (0..).zip(&mut stations) {
        station.publish(&load.form.births(index, load.points, now()))?;
    }
    // Births are many times as long as values.
    std::thread::sleep(Duration::from_secs(2));
    let per_station = Duration::from_secs_f64(f64::from(load.points) / load.rate);
    let (start, mut sent) = (Instant::now(), 0_u32);
    'rounds: for round in 0.. {
        for (index, station) in (0..).zip(&mut stations) {
            let due = per_station * sent;
            if due.as_secs_f64() >= load.seconds {
                break 'rounds;
            }
            std::thread::sleep(due.saturating_sub(start.elapsed()));
            station.publish(&load.form.data(index, load.points, round, now()))?;
            sent += 1;
        }
    }
    Ok((u64::from(sent) * u64::from(load.points), start.elapsed().as_secs_f64()))
}

/// Returns the time as nanoseconds since 1970.
pub(crate) fn now() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as i64)
}

/// Connection of one station.
struct Station(TcpStream);

impl Station {
    fn connect(port: u16, station: u32) -> Result<Self> {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).context("no broker")?;
        stream.set_nodelay(true)?;
        let mut output = BytesMut::new();
        let connect = Connect { keep_alive: 0, ..Connect::new(format!("station{station}")) };
        Packet::Connect(connect).write(&mut output, usize::MAX)?;
        stream.write_all(&output)?;
        let mut answer = [0; 4];
        stream.read_exact(&mut answer)?;
        ensure!(answer == [0x20, 2, 0, 0], "the broker refuses station {station}: {answer:?}");
        Ok(Self(stream))
    }

    fn publish(&mut self, messages: &[Outgoing]) -> Result<()> {
        let mut output = BytesMut::new();
        for Outgoing { topic, payload } in messages {
            let message = Publish::new(topic.as_str(), QoS::AtMostOnce, payload.clone());
            Packet::Publish(message).write(&mut output, usize::MAX)?;
        }
        Ok(self.0.write_all(&output)?)
    }
}
