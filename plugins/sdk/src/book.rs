//! Book for authors of plugins, chapter by chapter.
//!
//! 1. [Start](start): a working plugin in five commands
//! 2. [The life of a plugin](life): what is called when
//! 3. [Threads](threads): which calls can meet, and threads of your own
//! 4. [Memory](memory): who owns what, and for how long
//! 5. [Errors](errors): what to report, how, and to whom
//! 6. [Belief](belief): when a value may be called good
//! 7. [Judging equipment](judging): verdicts of overlays, and what they may rest on
//! 8. [Settings](settings): settings and addresses that explain themselves
//! 9. [Testing](testing): without a device, without waiting
//! 10. [Simulation](simulation): a plugin that is its own device
//! 11. [Commands](commands): subcommands of the program
//! 12. [In C](c): the header alone
//! 13. [Versions](versions): what stays, what changes
//! 14. [Before a release](checklist): a list to go through

#[doc = include_str!("book/start.md")]
pub mod start {}

#[doc = include_str!("book/life.md")]
pub mod life {}

#[doc = include_str!("book/threads.md")]
pub mod threads {}

#[doc = include_str!("book/memory.md")]
pub mod memory {}

#[doc = include_str!("book/errors.md")]
pub mod errors {}

#[doc = include_str!("book/belief.md")]
pub mod belief {}

#[doc = include_str!("book/judging.md")]
pub mod judging {}

#[doc = include_str!("book/settings.md")]
pub mod settings {}

#[doc = include_str!("book/testing.md")]
pub mod testing {}

#[doc = include_str!("book/simulation.md")]
pub mod simulation {}

#[doc = include_str!("book/commands.md")]
pub mod commands {}

#[doc = include_str!("book/c.md")]
pub mod c {}

#[doc = include_str!("book/versions.md")]
pub mod versions {}

#[doc = include_str!("book/checklist.md")]
pub mod checklist {}
