//! egui panels: a view model in, commands out
