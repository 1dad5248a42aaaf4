use std::process::ExitCode;

use keydance::{cli, ranks};

fn main() -> ExitCode {
    match cli::parse().run() {
        Ok(code) => {
            ranks::leave();
            code
        }
        // Without a farewell: other ranks may wait for this one, which their launcher then ends.
        Err(error) => cli::report(&error),
    }
}
