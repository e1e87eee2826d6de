//! The `idmesh` command: see [`idmesh::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    idmesh::cli::main()
}
