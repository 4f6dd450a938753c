//! Which requests are answered: those with the token, for this address by name, and not from the page of another site. Pure.
//!
//! The server is on 127.0.0.1, where every user of the machine and every page in the browser can reach it. So a request must
//! bring the token, which is new for each server and printed by it only; must be for this address by name
//! (else a page of another site whose name suddenly leads here could read: DNS rebinding); and must not come from the page of
//! another site.

/// The way in.
#[derive(Clone, Debug)]
pub(crate) struct Guard {
    token: String,
    hosts: [String; 2],
}

/// What a request says of itself.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Caller<'a> {
    /// The header `Host`.
    pub(crate) host: Option<&'a str>,
    /// The header `Origin`, which browsers add to what pages ask of other sites, and to all that changes something.
    pub(crate) origin: Option<&'a str>,
    /// The token that it brings.
    pub(crate) token: Option<&'a str>,
}

impl Guard {
    /// For the server at this port.
    pub(crate) fn new(token: String, port: u16) -> Guard {
        Guard { token, hosts: ["127.0.0.1", "localhost"].map(|host| format!("{host}:{port}")) }
    }

    /// The address to open.
    pub(crate) fn url(&self) -> String {
        format!("http://{}/?token={}", self.hosts[0], self.token)
    }

    /// Whether a request is for this server, and not from the page of another site.
    pub(crate) fn is_here(&self, caller: Caller<'_>) -> bool {
        let known = |host: &str| self.hosts.iter().any(|own| own == host);
        let origin = caller.origin.map(|origin| origin.strip_prefix("http://").is_some_and(known));
        caller.host.is_some_and(known) && origin.unwrap_or(true)
    }

    /// Whether it may look, and act.
    pub(crate) fn admits(&self, caller: Caller<'_>) -> bool {
        self.is_here(caller) && caller.token.is_some_and(|token| same(token.as_bytes(), self.token.as_bytes()))
    }
}

/// Compares in a time that does not tell where the first difference is.
fn same(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |differs, (a, b)| differs | (a ^ b)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_who_has_the_token_and_is_here_gets_in() {
        let guard = Guard::new("secret".to_owned(), 8080);
        assert_eq!(guard.url(), "http://127.0.0.1:8080/?token=secret");
        let own = Caller { host: Some("127.0.0.1:8080"), origin: None, token: Some("secret") };
        let check = |caller: Caller<'_>, here: bool, admitted: bool| {
            assert_eq!((guard.is_here(caller), guard.admits(caller)), (here, admitted), "{caller:?}");
        };
        check(own, true, true);
        check(Caller { host: Some("localhost:8080"), ..own }, true, true);
        check(Caller { origin: Some("http://127.0.0.1:8080"), ..own }, true, true);
        check(Caller { token: None, ..own }, true, false);
        for token in ["", "secre", "secret2", "Secret"] {
            check(Caller { token: Some(token), ..own }, true, false);
        }
        // A name that leads here since a moment ago; another port; no name at all.
        for host in [Some("evil.example:8080"), Some("127.0.0.1"), Some("127.0.0.1:80"), Some(""), None] {
            check(Caller { host, ..own }, false, false);
        }
        for origin in ["http://evil.example", "https://127.0.0.1:8080", "http://127.0.0.1:8081", "null", ""] {
            check(Caller { origin: Some(origin), ..own }, false, false);
        }
    }
}
