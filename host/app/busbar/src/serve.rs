//! Subcommand `busbar serve`: the view as a web page.

use std::ffi::OsString;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::Duration;

use anyhow::{Context, anyhow, bail};
use busbar_web::{Options, Server, Token};

use crate::arguments::ServeOptions;
use crate::systemd::Watchdog;
use crate::{output, simulate};

/// Environment variable with the token, when no file is named.
const TOKEN_VARIABLE: &str = "BUSBAR_TOKEN";
/// Period at which the end of the program is polled.
const POLL_PERIOD: Duration = Duration::from_millis(100);
/// Longest silence of the viewer's polling thread. Beyond it systemd's watchdog is fed no more:
/// pages show nothing that is live.
const MAX_SILENCE: Duration = Duration::from_secs(5);

pub(crate) fn run(options: &ServeOptions) -> anyhow::Result<ExitCode> {
    let ending = simulate::ending_by_signal()?;
    let (token, is_new) = token(options.token_file.as_deref())?;
    let server = Server::start(&Options {
        program: program()?,
        config: absolute(&options.config)?,
        listen: options.listen,
        insecure_remote: options.insecure_remote,
        token: token.clone(),
        allowed_origins: options.allow_origin.clone(),
        max_clients: options.clients,
        panels: options.panels,
        operator: options.operator.clone().unwrap_or_default(),
    })?;
    if options.insecure_remote && !options.listen.ip().is_loopback() {
        tracing::warn!("nothing is encrypted: whoever can listen in has the token and the view");
    }
    // A token of somebody else's making is not told again.
    let address = server.address();
    output::result(&match is_new {
        true => format!("http://{address}/?token={}", token.reveal()),
        false => format!("http://{address}/"),
    });
    let mut watchdog = Watchdog::default();
    while !ending.load(Ordering::Relaxed) {
        if let Some(failure) = server.failure() {
            bail!("{failure}");
        }
        if server.silence() < MAX_SILENCE {
            watchdog.feed();
        }
        std::thread::sleep(POLL_PERIOD);
    }
    watchdog.end();
    Ok(ExitCode::SUCCESS)
}

/// Returns the token, and whether it was generated here.
fn token(file: Option<&Path>) -> anyhow::Result<(Token, bool)> {
    let given = match (file, std::env::var(TOKEN_VARIABLE)) {
        (Some(file), _) => {
            let text = std::fs::read_to_string(file).with_context(|| {
                format!(
                    "the token cannot be read from '{}'\n  remedy: make it a text file with the \
                     token alone that this program may read",
                    file.display()
                )
            })?;
            warn_of_readers(file);
            let place = || format!("'{}'", file.display());
            Some(Token::parse(&text).with_context(place)?)
        }
        (None, Ok(text)) => Some(Token::parse(&text).context(TOKEN_VARIABLE)?),
        (None, Err(std::env::VarError::NotPresent)) => None,
        (None, Err(error)) => bail!("{TOKEN_VARIABLE}: {error}"),
    };
    Ok(match given {
        Some(token) => (token, false),
        None => (Token::random()?, true),
    })
}

/// Warns where others of this machine can read the token.
fn warn_of_readers(file: &Path) {
    const OTHERS: u32 = 0o044;
    let is_read = std::fs::metadata(file).is_ok_and(|file| file.permissions().mode() & OTHERS != 0);
    if is_read {
        tracing::warn!("others can read '{}'; take that from them: chmod 600", file.display());
    }
}

/// Returns the path of this program, which is the viewer too.
fn program() -> anyhow::Result<OsString> {
    Ok(std::env::current_exe().context("this program does not know where it is")?.into())
}

fn absolute(config: &Path) -> anyhow::Result<String> {
    if !config.is_file() {
        bail!("there is no configuration '{}'\n  remedy: name a file", config.display());
    }
    let path = std::path::absolute(config)?.into_os_string().into_string();
    path.map_err(|path| anyhow!("{}: the path is not UTF-8", path.to_string_lossy()))
}
