//! Starting processes for plugins.
//!
//! The kernel ends a child with the *thread* that started it, so that one thread
//! starts all of them and lasts as long as the viewer.

use std::io::{PipeReader, pipe};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::sync::mpsc::{Sender, SyncSender, channel, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use rustix::io::ioctl_fionbio;

use crate::environment::Environment;

/// The name of the program that hosts plugins.
const PROGRAM: &str = "busbar";
/// Command-line verb of the child process.
const COMMAND: &str = "plugin-host";
/// glibc reserves 64 MB of address space an arena, which the memory limit counts:
/// a plugin of many threads shares these.
const ARENAS: (&str, &str) = ("MALLOC_ARENA_MAX", "16");
/// The longest that sending one piece to a process that does not read may take.
const SEND_TIMEOUT: Duration = Duration::from_millis(500);

/// A process that waits for its first message.
pub(crate) struct SpawnedProcess {
    pub(crate) child: Child,
    pub(crate) socket: UnixStream,
    /// Pipe of its standard output and error, non-blocking.
    pub(crate) output: PipeReader,
}

type Reply = Result<SpawnedProcess, String>;
/// Environment of the new process, and channel for the result.
type SpawnRequest = (Environment, SyncSender<Reply>);

/// Starts a process through the thread that is parent of all.
pub(crate) fn spawn(environment: &Environment) -> Reply {
    static STARTER: Mutex<Option<Sender<SpawnRequest>>> = Mutex::new(None);
    let fault = |error: &dyn std::fmt::Display| format!("no process can be started: {error}");
    let (sender, reply) = sync_channel(1);
    {
        let mut starter = STARTER.lock().unwrap_or_else(PoisonError::into_inner);
        if starter.is_none() {
            let (orders, received) = channel::<SpawnRequest>();
            let work = move || {
                let program = host_program();
                for (environment, asker) in received {
                    let spawned = program.clone().and_then(|program| start(&program, &environment));
                    // Who asked may have given up.
                    let _ = asker.send(spawned.map_err(|error| fault(&error)));
                }
            };
            let builder = thread::Builder::new().name("plugin starter".into());
            builder.spawn(work).map_err(|error| fault(&error))?;
            *starter = Some(orders);
        }
        let sent = starter.as_ref().map(|orders| orders.send((environment.clone(), sender)));
        if !matches!(sent, Some(Ok(()))) {
            return Err(fault(&"the thread that starts them is gone"));
        }
    }
    reply.recv().map_err(|error| fault(&error))?
}

/// The program with the command that hosts plugins: this one, or the one beside
/// it or in the folder above.
fn host_program() -> Result<PathBuf, String> {
    let own = std::env::current_exe().map_err(|error| error.to_string())?;
    // The kernel says so of a program whose file was replaced while it runs.
    let name = own.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if name.strip_suffix(" (deleted)").unwrap_or(&name) == PROGRAM {
        return Ok("/proc/self/exe".into());
    }
    let mut folders = own.ancestors().skip(1).take(2);
    folders.find_map(|folder| Some(folder.join(PROGRAM)).filter(|path| path.is_file())).ok_or_else(
        || {
            format!(
                "there is no program '{PROGRAM}' beside {} or in the folder above; put it there, \
                 or say \"isolation\": \"none\"",
                own.display()
            )
        },
    )
}

fn start(program: &Path, environment: &Environment) -> Reply {
    let text = |error: std::io::Error| format!("{}: {error}", program.display());
    let (socket, theirs) = UnixStream::pair().map_err(text)?;
    socket.set_write_timeout(Some(SEND_TIMEOUT)).map_err(text)?;
    let (output, writer) = pipe().map_err(text)?;
    ioctl_fionbio(output.as_fd(), true).map_err(|error| text(error.into()))?;
    let mut command = Command::new(program);
    environment.apply(command.arg0(PROGRAM).arg(COMMAND));
    command.env(ARENAS.0, ARENAS.1);
    command.stdin(OwnedFd::from(theirs)).stdout(writer.try_clone().map_err(text)?).stderr(writer);
    // Signals of a terminal are for the viewer, with which the process ends.
    let child = command.process_group(0).spawn().map_err(text)?;
    Ok(SpawnedProcess { child, socket, output })
}
