//! Book for authors of plugins, chapter by chapter.
//!
//! 1. [Getting started](getting_started): a working plugin in five commands
//! 2. [Lifecycle](lifecycle): what is called when
//! 3. [Threads](threads): which calls can meet, and threads of your own
//! 4. [Memory](memory): who owns what, and for how long
//! 5. [Errors](errors): what to report, how, and to whom
//! 6. [Data quality](data_quality): when a value may be called good
//! 7. [Verdicts on equipment](verdicts): verdicts of overlays, and what they may rest on
//! 8. [Settings](settings): settings and addresses that explain themselves
//! 9. [Testing](testing): without a device, without waiting
//! 10. [Simulation](simulation): a plugin that is its own device
//! 11. [Commands](commands): subcommands of the program
//! 12. [In C](c): the headers alone
//! 13. [Versions](versions): what stays, what changes
//! 14. [Before a release](checklist): a list to go through

pub mod getting_started {
    #![doc = include_str!("book/getting_started.md")]
}

pub mod lifecycle {
    #![doc = include_str!("book/lifecycle.md")]
}

pub mod threads {
    #![doc = include_str!("book/threads.md")]
}

pub mod memory {
    #![doc = include_str!("book/memory.md")]
}

pub mod errors {
    #![doc = include_str!("book/errors.md")]
}

pub mod data_quality {
    #![doc = include_str!("book/data_quality.md")]
}

pub mod verdicts {
    #![doc = include_str!("book/verdicts.md")]
}

pub mod settings {
    #![doc = include_str!("book/settings.md")]
}

pub mod testing {
    #![doc = include_str!("book/testing.md")]
}

pub mod simulation {
    #![doc = include_str!("book/simulation.md")]
}

pub mod commands {
    #![doc = include_str!("book/commands.md")]
}

pub mod c {
    #![doc = include_str!("book/c.md")]
}

pub mod versions {
    #![doc = include_str!("book/versions.md")]
}

pub mod checklist {
    #![doc = include_str!("book/checklist.md")]
}
