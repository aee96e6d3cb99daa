// Checks a time of impact against the vectors: rustc -O --edition 2021 check.rs && ./check [--exact] discs.txt
// Put your engine's call into time_of_impact; README.md describes the file and the errors.

use std::{env, fs, process::exit};

/// x, y, vx, vy, radius
type Disc = [f64; 5];

/// When two discs begin to touch, from 0 on, in units of time. This one is the quadratic in doubles.
fn time_of_impact(a: Disc, b: Disc) -> Option<f64> {
    let [dx, dy, vx, vy] = [0, 1, 2, 3].map(|i| b[i] - a[i]);
    let reach = a[4] + b[4];
    let approach = dx * vx + dy * vy;
    let gap = dx * dx + dy * dy - reach * reach;
    if approach >= 0.0 {
        return None;
    }
    if gap <= 0.0 {
        return Some(0.0);
    }
    let d = approach * approach - (vx * vx + vy * vy) * gap;
    (d > 0.0).then(|| gap / (d.sqrt() - approach))
}

/// The number that a word such as "-0x1.8p-4" writes: at most 53 bits, and powers far from the limits.
fn double(word: &str) -> Option<f64> {
    let (digits, power) = word.trim_start_matches('-').strip_prefix("0x")?.split_once('p')?;
    let (whole, part) = digits.split_once('.').unwrap_or((digits, ""));
    let bits = i64::from_str_radix(&format!("{whole}{part}"), 16).ok()?;
    let size = bits as f64 * 2f64.powi(power.parse::<i32>().ok()? - 4 * part.len() as i32);
    Some(if word.starts_with('-') { -size } else { size })
}

/// The grade, e, the tick, and the two discs of a line.
fn question(line: &str) -> Option<(usize, i32, Option<i64>, Disc, Disc)> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let grade = GRADES.iter().position(|grade| Some(grade) == words.first())?;
    let tick = if words[3] == "-" { None } else { Some(words[3].parse().ok()?) };
    let numbers = words[4..].iter().map(|word| double(word)).collect::<Option<Vec<f64>>>()?;
    let discs = (numbers.get(..5)?.try_into().ok()?, numbers.get(5..)?.try_into().ok()?);
    Some((grade, words[2].parse().ok()?, tick, discs.0, discs.1))
}

const GRADES: [&str; 3] = ["exact", "clear", "close"];
const KINDS: [&str; 4] = ["right", "hits missed", "misses hit", "ticks wrong"];

fn main() {
    let words: Vec<String> = env::args().skip(1).collect();
    let all = words.first().is_some_and(|word| word == "--exact");
    let text = fs::read_to_string(words.last().expect("say: check [--exact] discs.txt")).expect("no such file");
    let (mut counts, mut worst, mut wrong) = ([[0; 4]; 3], [0.0; 3], 0);
    for line in text.lines() {
        let (grade, e, right, a, b) = question(line).expect("a line cannot be read");
        let kind = match (time_of_impact(a, b), right) {
            (None, None) => 0,
            (None, Some(_)) => 1,
            (Some(_), None) => 2,
            (Some(time), Some(tick)) => {
                let found = (time * 2f64.powi(52) * 2f64.powi(e)).floor(); // a tick is 2^-(52 + e)
                worst[grade] = f64::max(worst[grade], (found - tick as f64).abs());
                if found as i64 == tick { 0 } else { 3 }
            }
        };
        counts[grade][kind] += 1;
        wrong += (kind > 0 && (all || grade == 0 || (grade == 1 && kind < 3))) as i32;
    }
    for (grade, row) in counts.iter().enumerate() {
        let told: Vec<String> = (0..4).map(|kind| format!("{} {}", row[kind], KINDS[kind])).collect();
        println!("{}: {}, by up to {:e}", GRADES[grade], told.join(", "), worst[grade]);
    }
    exit((wrong > 0 || counts[0][0] == 0) as i32);
}
