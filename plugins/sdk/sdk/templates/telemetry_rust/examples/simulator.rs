//! Simulated device to try the plugin with: `cargo run --example simulator`.

use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

const PERIOD: Duration = Duration::from_millis(200);

fn main() -> std::io::Result<()> {
    let address = std::env::args().nth(1).unwrap_or("127.0.0.1:7070".into());
    let listener = TcpListener::bind(&address)?;
    println!("listening on {}", listener.local_addr()?);
    for client in listener.incoming() {
        let client = client?;
        std::thread::spawn(move || serve(client));
    }
    Ok(())
}

/// Writes a line for each value until the client goes.
fn serve(mut client: TcpStream) -> std::io::Result<()> {
    let start = Instant::now();
    loop {
        let seconds = start.elapsed().as_secs_f64();
        let temperature = 60.0 + 5.0 * (seconds / 10.0).sin();
        writeln!(client, "temperature {temperature:.2}\nalarm {}", u8::from(temperature > 63.0))?;
        std::thread::sleep(PERIOD);
    }
}
