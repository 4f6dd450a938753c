//! Agents are many processes of one executable. A position-independent one has its tables of addresses relocated, and so
//! copied, in each of them: 0.2 MiB per agent. So it is linked at a fixed address.

#![expect(clippy::disallowed_methods, reason = "cargo tells build scripts of their target by the environment")]

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let target = |key: &str| std::env::var(key).unwrap_or_default();
    // Other C libraries have their own ways to link; there it stays as it is.
    if target("CARGO_CFG_TARGET_OS") == "linux" && target("CARGO_CFG_TARGET_ENV") == "gnu" {
        println!("cargo::rustc-link-arg-bin=shoal=-no-pie");
    }
}
