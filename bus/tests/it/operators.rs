//! Operators that the daemon should not have to mind: noise, floods, clients that stop half way or never read.
#![expect(clippy::disallowed_methods, reason = "tests use sockets and clocks")]

use crate::home::Home;
use protocol::operator_to_daemon::{PROTOCOL_VERSION, Reply, Request};
use shoal_bus::{Noise, OperatorClient, OperatorServer};
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

const TIMEOUT: Duration = Duration::from_secs(20);

fn frame(magic: &[u8; 4], version: u32, len: u32, body: &[u8]) -> Vec<u8> {
    [magic.as_slice(), &version.to_le_bytes(), &len.to_le_bytes(), body].concat()
}

fn dial(home: &Home) -> UnixStream {
    let stream = UnixStream::connect(home.0.file("operator")).unwrap();
    stream.set_read_timeout(Some(TIMEOUT)).unwrap();
    stream
}

/// Answers everything with the number of a task, until the condition holds.
fn serve_until(server: &mut OperatorServer, mut done: impl FnMut() -> bool) {
    let deadline = Instant::now() + TIMEOUT;
    while !done() {
        assert!(Instant::now() < deadline, "not within {TIMEOUT:?}");
        while let Some((_, responder)) = server.take() {
            responder.reply(&reply(7));
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// An answer that can be told from others.
fn reply(number: usize) -> Reply {
    Reply::Refused { problem: number.to_string(), hint: None }
}

/// What a client is sent that says this, in words.
fn answer_to(server: &mut OperatorServer, home: &Home, bytes: &[u8]) -> String {
    let mut stream = dial(home);
    stream.write_all(bytes).unwrap();
    let reader = std::thread::spawn(move || {
        let mut reply = Vec::new();
        let _ = stream.read_to_end(&mut reply);
        String::from_utf8_lossy(&reply).into_owned()
    });
    serve_until(server, || reader.is_finished());
    reader.join().unwrap()
}

#[test]
fn what_is_not_a_request_is_refused_and_costs_nothing_else() {
    let home = Home::new();
    let mut server = OperatorServer::open(&home.0).unwrap();
    let mut check = |bytes: &[u8], words: &str| {
        let answer = answer_to(&mut server, &home, bytes);
        assert!(answer.contains(words), "{words}: {answer:?}");
    };
    // A task for a robot whose name has 2^62 bytes.
    let body = [0x02, 0xfd, 0, 0, 0, 0, 0, 0, 0, 0x40];
    check(&frame(b"shOp", PROTOCOL_VERSION, body.len() as u32, &body), "the request is not readable");
    check(&frame(b"shOp", PROTOCOL_VERSION, 4, &[0xff; 4]), "the request is not readable");
    check(&frame(b"shOp", PROTOCOL_VERSION, 2, &[0, 0]), "left over");
    check(&frame(b"shOp", PROTOCOL_VERSION, u32::MAX, &[0; 100]), "the request is too long");
    let other = PROTOCOL_VERSION + 1;
    check(&frame(b"shOp", other, 1, &[0]), &format!("protocol version {other}, this fleet speaks {PROTOCOL_VERSION}"));
    check(b"GET / HTTP/1.1\r\n\r\n", "this is not a request of shoal");
    let Noise { count, newest } = server.noise();
    assert_eq!((*count, newest.as_str()), (6, "this is not a request of shoal"));
}

/// More of them than there are places: each keeps its place for a moment, and none for ever.
#[test]
fn clients_that_never_read_their_reply_make_room() {
    let home = Home::new();
    let mut server = OperatorServer::open(&home.0).unwrap();
    let large = Reply::Refused { problem: "x".repeat(1 << 20), hint: None };
    let deadline = Instant::now() + TIMEOUT;
    let mut silent = Vec::new();
    for _ in 0..300 {
        let mut stream = dial(&home);
        stream.write_all(&frame(b"shOp", PROTOCOL_VERSION, 1, &[0])).unwrap();
        silent.push(stream);
        while silent.len() % 64 == 0 && Instant::now() < deadline {
            let Some((_, responder)) = server.take() else { break };
            responder.reply(&large);
        }
    }
    let address = home.0.clone();
    let client = std::thread::spawn(move || OperatorClient::new(&address).ask(&Request::Status, TIMEOUT));
    while !client.is_finished() {
        assert!(Instant::now() < deadline, "not within {TIMEOUT:?}");
        while let Some((_, responder)) = server.take() {
            responder.reply(&large);
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    assert_eq!(client.join().unwrap(), Ok(large));
}

/// What arrives is changed at random, in its header and behind it: it is answered or dropped, and the next client is served.
#[test]
fn mutated_frames_do_no_harm() {
    let home = Home::new();
    let mut server = OperatorServer::open(&home.0).unwrap();
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut below = |bound: u64| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % bound) as usize
    };
    let whole = frame(b"shOp", PROTOCOL_VERSION, 1, &[0]);
    let mut requests = 0;
    for _ in 0..3000 {
        let mut bytes = whole.clone();
        for _ in 0..below(3) {
            let at = below(bytes.len() as u64);
            bytes[at] ^= 1 << below(8);
        }
        bytes.truncate(whole.len() - below(3).min(below(14)));
        let mut stream = dial(&home);
        // The server may have hung up already.
        let _ = stream.write_all(&bytes);
        if below(2) == 0 {
            drop(stream);
        }
        while let Some((_, responder)) = server.take() {
            requests += 1;
            responder.reply(&reply(7));
        }
    }
    assert!(requests > 300 && server.noise().count > 300, "{requests}, {:?}", server.noise());
    let address = home.0.clone();
    let client = std::thread::spawn(move || OperatorClient::new(&address).ask(&Request::Status, TIMEOUT));
    serve_until(&mut server, || client.is_finished());
    assert_eq!(client.join().unwrap(), Ok(reply(7)));
}

#[test]
fn clients_that_stop_half_way_keep_nobody_waiting() {
    let home = Home::new();
    let mut server = OperatorServer::open(&home.0).unwrap();
    // More than there are places, each with a part of a header, and one that delivers nothing at all.
    let silent: Vec<UnixStream> = (0..300)
        .map(|i| {
            let mut stream = dial(&home);
            stream.write_all(&b"shOp\x01"[..i % 6]).unwrap();
            server.take();
            stream
        })
        .collect();
    let address = home.0.clone();
    let client = std::thread::spawn(move || OperatorClient::new(&address).ask(&Request::Status, TIMEOUT));
    serve_until(&mut server, || client.is_finished());
    assert_eq!(client.join().unwrap(), Ok(reply(7)));
    drop(silent);
}

#[test]
fn a_client_that_reads_slowly_gets_its_whole_reply_and_delays_no_other() {
    let home = Home::new();
    let mut server = OperatorServer::open(&home.0).unwrap();
    let mut slow = dial(&home);
    slow.write_all(&frame(b"shOp", PROTOCOL_VERSION, 1, &[0])).unwrap();
    let problem = "x".repeat(2 << 20);
    let deadline = Instant::now() + TIMEOUT;
    let responder = loop {
        if let Some((Request::Status, responder)) = server.take() {
            break responder;
        }
        assert!(Instant::now() < deadline);
    };
    responder.reply(&Reply::Refused { problem: problem.clone(), hint: None });
    // Another one is served while most of that reply is still here.
    let address = home.0.clone();
    let client = std::thread::spawn(move || OperatorClient::new(&address).ask(&Request::Status, TIMEOUT));
    serve_until(&mut server, || client.is_finished());
    assert_eq!(client.join().unwrap(), Ok(reply(7)));
    let reader = std::thread::spawn(move || {
        let mut reply = Vec::new();
        slow.read_to_end(&mut reply).unwrap();
        reply
    });
    serve_until(&mut server, || reader.is_finished());
    assert!(reader.join().unwrap().windows(1000).any(|window| window == &problem.as_bytes()[..1000]));
}

#[test]
fn a_burst_is_served_to_the_last() {
    let home = Home::new();
    let mut server = OperatorServer::open(&home.0).unwrap();
    let clients: Vec<_> = (0..200)
        .map(|_| {
            let address = home.0.clone();
            std::thread::spawn(move || OperatorClient::new(&address).ask(&Request::Status, TIMEOUT))
        })
        .collect();
    serve_until(&mut server, || clients.iter().all(std::thread::JoinHandle::is_finished));
    for client in clients {
        assert_eq!(client.join().unwrap(), Ok(reply(7)));
    }
}

#[test]
fn an_answer_may_come_later() {
    let home = Home::new();
    let mut server = OperatorServer::open(&home.0).unwrap();
    let ask = || {
        let address = home.0.clone();
        std::thread::spawn(move || OperatorClient::new(&address).ask(&Request::Status, TIMEOUT))
    };
    let (first, second) = (ask(), ask());
    let mut kept = Vec::new();
    let deadline = Instant::now() + TIMEOUT;
    while kept.len() < 2 {
        kept.extend(server.take());
        assert!(Instant::now() < deadline);
    }
    assert!(kept.iter().all(|(_, responder)| responder.is_awaited()));
    for (task, (_, responder)) in kept.into_iter().enumerate().rev() {
        responder.reply(&reply(task));
    }
    let mut answers = [first.join().unwrap(), second.join().unwrap()].map(|answer| match answer {
        Ok(Reply::Refused { problem, .. }) => problem.parse::<usize>().unwrap(),
        other => panic!("{other:?}"),
    });
    answers.sort_unstable();
    assert_eq!(answers, [0, 1]);
    // One that is dropped without an answer tells the operator so.
    let third = ask();
    let responder = loop {
        if let Some((_, responder)) = server.take() {
            break responder;
        }
        assert!(Instant::now() < deadline);
    };
    drop(responder);
    assert!(third.join().unwrap().unwrap_err().to_string().contains("without an answer"));
}
