//! TCP sockets of processes by `/proc`: who listens, and who is connected to whom.

use std::collections::{HashMap, HashSet};
use std::fs::{self, File};
use std::io::Read;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};

/// Bytes that are read of a table of sockets.
const MAX_TABLE_BYTES: u64 = 16 << 20;
/// Bytes that are read of a process's state.
const MAX_STAT_BYTES: u64 = 4096;
/// Limit of processes in a scan.
const MAX_PROCESSES: usize = 1 << 16;
/// Limit of descriptors of one process in a scan.
const MAX_DESCRIPTORS: usize = 1 << 16;
/// State of a listening socket in the kernel's tables.
const LISTENING: u8 = 0x0a;

/// TCP socket from `/proc/net/tcp`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct TcpSocket {
    local: SocketAddr,
    remote: SocketAddr,
    is_listening: bool,
}

/// Start of a process, clock ticks since boot; none where it has ended.
pub(crate) fn start_ticks(pid: u32) -> Option<u64> {
    // Fields 3 (state) and on; field 22 is the start (proc_pid_stat(5)).
    stat_fields(pid)?.split_whitespace().nth(22 - 3)?.parse().ok()
}

/// TCP sockets of this machine at one instant, with the owners of some.
#[derive(Debug)]
pub(crate) struct SocketScan {
    /// Children of each process.
    children: HashMap<u32, Vec<u32>>,
    /// Sockets of this process's network by their inodes.
    table: HashMap<u64, TcpSocket>,
    /// Sockets of the processes of interest, and of their children.
    others: Vec<TcpSocket>,
}

impl SocketScan {
    /// Scans the sockets; those of `others` and their children are listed apart.
    pub(crate) fn scan(others: &[u32]) -> Self {
        let children = children();
        let of_tree = |pid: &u32| {
            let table = read_table(*pid);
            let tree = with_descendants(*pid, &children);
            tree.into_iter().flat_map(move |pid| sockets_of(pid, &table)).collect::<Vec<_>>()
        };
        let others = others.iter().flat_map(of_tree).collect();
        Self { children, table: read_table(std::process::id()), others }
    }

    /// Reports whether a socket of a process is connected to one of the others.
    pub(crate) fn is_connected(&self, process: SocketOwner) -> bool {
        let own = match process {
            SocketOwner::Process(pid) => vec![pid],
            SocketOwner::ProcessTree(pid) => with_descendants(pid, &self.children),
        };
        let mut own = own.into_iter().flat_map(|pid| sockets_of(pid, &self.table));
        own.any(|own| self.others.iter().any(|other| own.leads_to(other)))
    }
}

/// Process that owns sockets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SocketOwner {
    /// A process without its children.
    Process(u32),
    /// A process with its children.
    ProcessTree(u32),
}

impl TcpSocket {
    /// Reports whether this is the client's end of a connection to another socket of this machine.
    fn leads_to(&self, other: &Self) -> bool {
        if self.is_listening {
            return false;
        }
        if !other.is_listening {
            return (self.remote, self.local) == (other.local, other.remote);
        }
        self.remote.port() == other.local.port()
            && match other.local.ip() {
                any if any.is_unspecified() => is_of_this_machine(self.remote.ip()),
                ip => ip == self.remote.ip(),
            }
    }
}

/// Reports whether an address is one of this machine's own: a socket can be bound to it.
fn is_of_this_machine(ip: IpAddr) -> bool {
    ip.is_loopback() || UdpSocket::bind((ip, 0)).is_ok()
}

/// Fields of a process's state after its name, which may hold anything.
fn stat_fields(pid: u32) -> Option<String> {
    let text = read_text(&format!("/proc/{pid}/stat"), MAX_STAT_BYTES)?;
    text.rsplit_once(')').map(|(_, fields)| fields.to_owned())
}

/// Children of each process.
fn children() -> HashMap<u32, Vec<u32>> {
    let mut children: HashMap<u32, Vec<u32>> = HashMap::new();
    let Ok(processes) = fs::read_dir("/proc") else { return children };
    let pids = processes.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok());
    for pid in pids.take(MAX_PROCESSES) {
        let parent = stat_fields(pid)
            .and_then(|fields| fields.split_whitespace().nth(4 - 3)?.parse::<u32>().ok());
        if let Some(parent) = parent {
            children.entry(parent).or_default().push(pid);
        }
    }
    children
}

fn with_descendants(pid: u32, children: &HashMap<u32, Vec<u32>>) -> Vec<u32> {
    let mut all = vec![pid];
    let mut next = 0;
    while let Some(parent) = all.get(next) {
        let more = children.get(parent).map_or(&[][..], Vec::as_slice);
        // A process has one parent; read while they change, one might show twice.
        let more: Vec<u32> = more.iter().copied().filter(|pid| !all.contains(pid)).collect();
        all.extend(more);
        next += 1;
    }
    all
}

/// TCP sockets of a table that a process has open; none where that may not be read.
fn sockets_of(pid: u32, table: &HashMap<u64, TcpSocket>) -> Vec<TcpSocket> {
    socket_inodes(pid).iter().filter_map(|inode| table.get(inode).copied()).collect()
}

/// TCP sockets of a process's network by their inodes.
fn read_table(pid: u32) -> HashMap<u64, TcpSocket> {
    let tables = ["tcp", "tcp6"].map(|name| format!("/proc/{pid}/net/{name}"));
    let texts = tables.into_iter().filter_map(|path| read_text(&path, MAX_TABLE_BYTES));
    texts.flat_map(|text| parse_table(&text)).collect()
}

fn socket_inodes(pid: u32) -> HashSet<u64> {
    let Ok(descriptors) = fs::read_dir(format!("/proc/{pid}/fd")) else { return HashSet::new() };
    let inode = |entry: std::io::Result<fs::DirEntry>| {
        let target = fs::read_link(entry.ok()?.path()).ok()?;
        target.to_str()?.strip_prefix("socket:[")?.strip_suffix(']')?.parse().ok()
    };
    descriptors.take(MAX_DESCRIPTORS).filter_map(inode).collect()
}

/// Sockets of a table by their inodes (proc_net_tcp in the kernel's documentation).
fn parse_table(text: &str) -> Vec<(u64, TcpSocket)> {
    let socket = |line: &str| {
        let mut fields = line.split_whitespace().skip(1);
        let (local, remote, state) = (fields.next()?, fields.next()?, fields.next()?);
        // Queues, timer, retransmissions, user and timeout lie between.
        let inode: u64 = fields.nth(5)?.parse().ok()?;
        let is_listening = u8::from_str_radix(state, 16).ok()? == LISTENING;
        let socket = TcpSocket { local: address(local)?, remote: address(remote)?, is_listening };
        Some((inode, socket))
    };
    text.lines().skip(1).filter_map(socket).collect()
}

/// An address as tables have it: words of 32 bits in the machine's order, and the port.
fn address(text: &str) -> Option<SocketAddr> {
    let (ip, port) = text.split_once(':')?;
    let word = |index: usize| {
        let digits = ip.get(8 * index..8 * index + 8)?;
        Some(u32::from_str_radix(digits, 16).ok()?.to_ne_bytes())
    };
    let ip = match ip.len() {
        8 => IpAddr::V4(Ipv4Addr::from(word(0)?)),
        32 => {
            let mut octets = [0; 16];
            for (index, four) in octets.chunks_exact_mut(4).enumerate() {
                four.copy_from_slice(&word(index)?);
            }
            Ipv6Addr::from(octets).to_canonical()
        }
        _ => return None,
    };
    Some(SocketAddr::new(ip, u16::from_str_radix(port, 16).ok()?))
}

fn read_text(path: &str, max_bytes: u64) -> Option<String> {
    let mut bytes = Vec::new();
    File::open(path).ok()?.take(max_bytes).read_to_end(&mut bytes).ok()?;
    Some(String::from_utf8_lossy(&bytes).into_owned())
}

#[cfg(test)]
mod tests {
    use std::net::{TcpListener, TcpStream};
    use std::process::{Command, Stdio};

    use super::*;

    #[test]
    fn this_process_has_started_and_one_that_is_not_there_has_not() {
        assert!(start_ticks(std::process::id()).is_some_and(|ticks| ticks > 0));
        assert_eq!(start_ticks(u32::MAX), None);
    }

    #[test]
    fn a_connection_to_a_process_of_this_machine_is_found() {
        let own = std::process::id();
        for bound in ["127.0.0.1:0", "0.0.0.0:0", "[::]:0", "[::1]:0"] {
            let Ok(listener) = TcpListener::bind(bound) else { continue };
            let port = listener.local_addr().unwrap().port();
            let host = if bound.starts_with("[::1]") { "::1" } else { "127.0.0.1" };
            let sockets = || sockets_of(own, &read_table(own));
            let leads = |from: &[TcpSocket], to: &[TcpSocket]| {
                from.iter()
                    .any(|from| from.remote.port() == port && to.iter().any(|to| from.leads_to(to)))
            };
            assert!(!leads(&sockets(), &sockets()), "{bound}");
            let stream = TcpStream::connect((host, port)).unwrap();
            assert!(leads(&sockets(), &sockets()), "{bound}");
            let (accepted, _) = listener.accept().unwrap();
            drop(listener);
            assert!(leads(&sockets(), &sockets()), "{bound}: by the connection itself");
            drop((stream, accepted));
        }
    }

    #[test]
    fn other_processes_and_other_addresses_are_not_it() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let stream = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let own = SocketOwner::Process(std::process::id());
        let is_connected = |own, other: u32| SocketScan::scan(&[other]).is_connected(own);
        assert!(is_connected(own, std::process::id()));
        let mut idle = Command::new("sleep").arg("60").stdin(Stdio::null()).spawn().unwrap();
        assert!(!is_connected(own, idle.id()));
        // The child is part of this process's tree, but has no socket of its own.
        assert!(!is_connected(SocketOwner::ProcessTree(idle.id()), std::process::id()));
        idle.kill().unwrap();
        idle.wait().unwrap();
        let at = |text: &str| text.parse::<SocketAddr>().unwrap();
        let listening =
            |text| TcpSocket { local: at(text), remote: at("0.0.0.0:0"), is_listening: true };
        let client = |text| TcpSocket {
            local: at("192.0.2.1:40000"),
            remote: at(text),
            is_listening: false,
        };
        assert!(client("127.0.0.1:502").leads_to(&listening("0.0.0.0:502")));
        assert!(!client("127.0.0.1:502").leads_to(&listening("0.0.0.0:503")));
        assert!(!client("127.0.0.1:502").leads_to(&listening("127.0.0.2:502")));
        assert!(!client("192.0.2.9:502").leads_to(&listening("0.0.0.0:502")), "another machine");
        drop((stream, listener));
    }

    #[test]
    fn tables_are_read_as_the_kernel_writes_them() {
        let text = "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   \
                    uid  timeout inode\n   0: 0100007F:01F6 00000000:0000 0A 00000000:00000000 \
                    00:00000000 00000000  1000        0 4711 1 0000000000000000 100 0 0 10 0\n";
        if cfg!(target_endian = "little") {
            let [(4711, socket)] = parse_table(text)[..] else { panic!("one socket") };
            assert_eq!(socket.local, "127.0.0.1:502".parse().unwrap());
            assert!(socket.is_listening);
        }
        assert_eq!(parse_table("head\n 0: zz 00 0A\n"), []);
    }
}
