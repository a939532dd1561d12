//! The report: what it holds, and how a browser shows it.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use fdi_core::report::{Change, Fleet};

use crate::{
    binary::fdi,
    explained::machine,
    stand_in::{GOOD, diagnose, folder},
};

fn committed(path: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures").join(path).display().to_string()
}

fn text(path: &Path) -> String {
    fs::read_to_string(path).unwrap()
}

#[test]
fn the_answer_stands_at_the_top() {
    let folder = folder(&[
        ("faulty-1.csv", GOOD),
        ("healthy-1.csv", GOOD),
        ("strange-1.csv", GOOD),
        ("x1-empty.csv", ""),
    ]);
    let page = folder.path().join("out.html");
    let (path, target) = (folder.path().display().to_string(), page.display().to_string());
    let outcome = diagnose(&["--stable", "--report", &target, &path]);
    assert_eq!(outcome.code, 2);
    let html = text(&page);
    let answer = html.split("class=\"answer\">").nth(1).unwrap().split("</p>").next().unwrap();
    assert_eq!(
        answer,
        "3 machines: 1 undecided (strange-1.csv), 2 with nothing to do. 3 recordings: 1 faulty, \
         1 healthy, 1 not explained by the model. The largest level is \
         short circuit of phase B 0.060 ± 0.002 in faulty-1.csv. 1 recording could not be \
         diagnosed."
    );
    // levels that are not to be believed are in brackets and not marked
    assert!(html.contains("data-value=\"0\">(0.000±0.002)</td>"));
    assert!(html.contains("empty file: expected a header row"));
    assert!(!folder.path().join("out-fleet.json").exists());
}

#[test]
fn determinism_a_report_is_the_same_for_any_number_of_jobs() {
    let names: Vec<String> = (0..30)
        .map(|i| format!("{}-{i:02}.csv", ["healthy", "faulty", "partial", "strange"][i % 4]))
        .collect();
    let files: Vec<_> = names.iter().map(|name| (name.as_str(), GOOD)).collect();
    let folder = folder(&files);
    let elsewhere = tempfile::tempdir().unwrap();
    let page = elsewhere.path().join("r.html");
    let with = |jobs: &str| {
        let (path, target) = (folder.path().display().to_string(), page.display().to_string());
        diagnose(&["--stable", "--jobs", jobs, "--report", &target, &path]);
        text(&page)
    };
    assert_eq!(with("1"), with("5"));
}

#[test]
fn a_page_says_what_it_is_of_and_what_is_left_out_on_paper() {
    let recording = |day: &str| format!("# operator = \"M. Rossi\"\n# date = {day}\n{GOOD}");
    let folder = folder(&[
        ("faulty-A.csv", &recording("2026-01-01")),
        ("healthy-A.csv", &recording("2026-02-01")),
    ]);
    let page = folder.path().join("page.html");
    let (path, target) = (folder.path().display().to_string(), page.display().to_string());
    assert_eq!(diagnose(&["--id-from", "*-{id}.csv", "--report", &target, &path]).code, 0);
    let html = text(&page);
    assert!(html.contains("<h1>Diagnosis of A</h1>"), "{html}");
    assert!(html.contains("2 recordings · 2026-01-01 to 2026-02-01 · operator M. Rossi"), "{html}");
    // of an earlier recording nothing is printed, of the latest what is not a detail
    assert_eq!(html.matches("class=\"screen\">\n<h2>").count(), 1);
    assert!(html.contains("<p class=\"paper\">"));
}

/// What the tests of trends diagnose: the name says actuator and date.
fn dated() -> tempfile::TempDir {
    folder(&[
        ("faulty-A_2026-03-01.csv", GOOD),
        ("healthy-A_2026-01-01.csv", GOOD),
        ("healthy-B_20260101.csv", GOOD),
        ("healthy-B_20260201.csv", GOOD),
        ("partial-x.csv", "# actuator-id = \"C\"\n# date = 2026-05-05\ntime_s,current_a\n0,1\n"),
        ("strange-A_2026-04-01.csv", GOOD),
    ])
}

#[test]
fn names_of_files_give_trends() {
    let folder = dated();
    let page = folder.path().join("sub/report.html");
    fs::create_dir(folder.path().join("sub")).unwrap();
    let (path, target) = (folder.path().display().to_string(), page.display().to_string());
    let arguments = [
        "--stable",
        "--id-from",
        "*-{id}_*",
        "--date-from",
        "*_{date}",
        "--report",
        &target,
        &path,
    ];
    assert_eq!(diagnose(&arguments).code, 0);
    let json = text(&folder.path().join("sub/report-fleet.json"));
    let fleet: Fleet = serde_json::from_str(&json).unwrap();
    let told: Vec<_> = fleet
        .actuators
        .iter()
        .map(|one| (one.actuator_id.as_str(), one.change, one.points.len()))
        .collect();
    let (warning, steady) = (Change::Warning, Change::Steady);
    assert_eq!(told, [("A", warning, 3), ("B", steady, 2), ("C", steady, 1)]);
    // 0.06 in 59 days, both with a standard deviation of 0.002
    let k4 = &fleet.actuators[0].points[1].faults[3];
    assert_eq!((k4.difference, k4.change), (Some(0.06), Some(warning)));
    let csv = text(&folder.path().join("sub/report-fleet.csv"));
    // six levels of five recordings, three of the one that leaves three open, and the header
    assert_eq!(csv.lines().count(), 1 + 5 * 6 + 3);
    let html = text(&page);
    assert!(html.contains("warning change of 0.02 or more: A (short circuit of phase B +0.0600"));
    let quiet = diagnose(&["--warning-change", "0.1", "--report", &target, &path]);
    assert_eq!(quiet.code, 0);
    assert!(!text(&page).contains("warning change of 0.1 or more"));
}

#[test]
fn json_says_which_actuator_and_when() {
    let folder = dated();
    let path = folder.path().display().to_string();
    let outcome = diagnose(&["--id-from", "*-{id}_*", "--output-format", "jsonl", &path]);
    let lines: Vec<serde_json::Value> =
        outcome.out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines[0]["actuator_id"], "A");
    assert!(lines[0]["date"].is_null());
    assert_eq!((&lines[4]["actuator_id"], &lines[4]["date"]), (&"C".into(), &"2026-05-05".into()));
}

/// The browser, or nothing and the reason why its tests are skipped.
#[track_caller]
fn browser() -> Option<PathBuf> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let found = std::env::split_paths(&folders)
        .flat_map(|folder| names.map(|name| folder.join(name)))
        .find(|path| path.is_file());
    if found.is_none() {
        skipped_tests::skip(&format!("none of {} is on the path", names.join(", ")));
    }
    found
}

/// What a page looks like in the browser: its document after `script`, and what the browser says.
fn shown(browser: &Path, page: &Path, width: u32, script: &str) -> (String, String, String) {
    let folder = tempfile::tempdir().unwrap();
    let probed = folder.path().join("probed.html");
    let html = text(page);
    let (before, after) = html.rsplit_once("</body>").unwrap();
    fs::write(&probed, format!("{before}<script>{script}</script></body>{after}")).unwrap();
    let net_log = folder.path().join("net.json");
    let output = Command::new(browser)
        .args(["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"])
        .args(["--disable-background-networking", "--disable-component-update", "--no-first-run"])
        .args(["--disable-sync", "--disable-extensions", "--disable-default-apps"])
        .args(["--enable-logging=stderr", "--virtual-time-budget=3000", "--dump-dom"])
        .arg(format!("--window-size={width},1000"))
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .arg(format!("--log-net-log={}", net_log.display()))
        .arg(format!("file://{}", probed.display()))
        .output()
        .unwrap();
    let words = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (words(output.stdout), words(output.stderr), text(&net_log))
}

/// Presses the second sortable heading of the table of recordings twice and the fit once, and tells what
/// is seen: order of the rows, sizes of the drawings, width of the page.
const PROBE: &str = r#"
const names = () => [...document.querySelectorAll("table")[1].tBodies[0].rows]
  .map((row) => row.cells[0].textContent).join(" ");
const press = (word) => [...document.querySelectorAll("th button")]
  .find((button) => button.textContent === word).click();
const told = [names()];
press("k1 friction"); told.push(names());
press("k1 friction"); told.push(names());
press("k7 direction"); told.push(names());
press("recording"); told.push(names());
const drawings = [...document.querySelectorAll("figure svg")].map((svg) => {
  const box = svg.getBoundingClientRect(), inner = svg.getBBox();
  return box.width > 300 && box.height > 100 && inner.width > 300
    && box.right <= document.documentElement.clientWidth
    && getComputedStyle(svg).visibility === "visible";
});
told.push(drawings.length + " " + drawings.every((seen) => seen));
told.push(document.documentElement.scrollWidth <= document.documentElement.clientWidth);
told.push(document.querySelectorAll("[aria-sort]").length);
document.body.dataset.told = told.join("|");
"#;

/// Lines of the browser's own log that come from the page.
fn console(log: &str) -> Vec<&str> {
    log.lines().filter(|line| line.contains("CONSOLE")).collect()
}

/// Addresses that the page asked for. Requests of the browser itself have no origin.
fn requests(net_log: &str) -> Vec<&str> {
    let asked = net_log.split("\"initiator\":\"").skip(1);
    let of_page = asked.filter(|rest| !rest.starts_with("not an origin\""));
    of_page.filter_map(|rest| rest.split("\"url\":\"").nth(1)?.split('"').next()).collect()
}

#[test]
fn a_browser_shows_it_and_sorts_and_asks_for_nothing() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("report.html");
    let names = ["r01", "r12", "r20", "r26"];
    let recordings = names.map(|name| committed(&format!("recordings/{name}.csv.gz")));
    let mut arguments =
        vec!["diagnose", "-q", "--tolerance", "none", "--report", page.to_str().unwrap()];
    arguments.extend(recordings.iter().map(String::as_str));
    assert_eq!(fdi(&arguments).0, 0);
    // a wide screen, and the 186 mm of A4 between its margins at 96 px an inch
    for width in [1280, 703] {
        let (dom, log, net_log) = shown(&browser, &page, width, PROBE);
        let told = dom.split("data-told=\"").nth(1).expect(&log).split('"').next().unwrap();
        let as_given = "r01.csv.gz r12.csv.gz r20.csv.gz r26.csv.gz";
        let upward = "r01.csv.gz r20.csv.gz r12.csv.gz r26.csv.gz";
        let downward = "r26.csv.gz r12.csv.gz r20.csv.gz r01.csv.gz";
        // k7 of r12 alone is determined: the others come after it, in the order they had
        let missing_last = "r12.csv.gz r26.csv.gz r20.csv.gz r01.csv.gz";
        let seen =
            format!("{as_given}|{upward}|{downward}|{missing_last}|{as_given}|12 true|true|1");
        assert_eq!(told, seen, "{width}");
        assert_eq!(console(&log), Vec::<&str>::new(), "{width}");
        assert_eq!(requests(&net_log), Vec::<&str>::new(), "{width}");
    }
}

/// The test above would see an error, and a request.
#[test]
fn a_browser_that_is_given_errors_and_requests_tells_them() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("bad.html");
    fs::write(&page, "<html><body><img src=\"http://127.0.0.1:9/x.png\"></body></html>").unwrap();
    let (_, log, net_log) = shown(&browser, &page, 800, "nothing.there();");
    assert!(console(&log).iter().any(|line| line.contains("nothing is not defined")), "{log}");
    assert!(requests(&net_log).contains(&"http://127.0.0.1:9/x.png"), "{net_log}");
}

/// Presses each heading of each table, and tells what is seen: number of tables, whether each is
/// sorted by what was pressed last, drawings and whether they are seen, width of the page.
const PRESS_ALL: &str = r#"
const tables = [...document.querySelectorAll("table.sortable")];
let sorted = 0;
for (const table of tables) {
  for (const button of table.querySelectorAll("th button")) button.click();
  const heads = [...table.tHead.rows[0].cells];
  sorted += heads[heads.length - 1].getAttribute("aria-sort") === "ascending";
}
const drawings = [...document.querySelectorAll("figure svg")];
const seen = drawings.every((svg) => {
  const box = svg.getBoundingClientRect(), inner = svg.getBBox();
  return box.width > 300 && box.height > 100 && inner.width > 300
    && box.right <= document.documentElement.clientWidth
    && getComputedStyle(svg).visibility === "visible";
});
const fits = document.documentElement.scrollWidth <= document.documentElement.clientWidth;
document.body.dataset.told =
  [tables.length, sorted === tables.length, drawings.length, seen, fits].join(" ");
"#;

/// What a browser tells of a page on a wide screen and on paper, without an error or a request.
fn told_of(page: &Path) -> Option<[String; 2]> {
    let browser = browser()?;
    Some([1280, 703].map(|width| {
        let (dom, log, net_log) = shown(&browser, page, width, PRESS_ALL);
        assert_eq!(console(&log), Vec::<&str>::new(), "{width}");
        assert_eq!(requests(&net_log), Vec::<&str>::new(), "{width}");
        dom.split("data-told=\"").nth(1).expect(&log).split('"').next().unwrap().to_owned()
    }))
}

/// The headings of a page, and its answer.
fn outline(html: &str) -> (Vec<&str>, &str) {
    let between = |text: &'_ str, end: &str| text.find(end).unwrap();
    let headings = html.split("<h2>").skip(1).map(|rest| &rest[..between(rest, "</h2>")]).collect();
    let answer = html.split("class=\"answer\">").nth(1).unwrap();
    (headings, &answer[..between(answer, "</p>")])
}

/// The drawings that stand alone in a folder, by name.
fn drawings(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    for name in &names {
        let svg = text(&folder.join(name));
        assert!(svg.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\""), "{name}");
    }
    names
}

#[test]
fn an_explanation_has_its_report() {
    let machine = machine();
    let at = |name: &str| machine.path().join(name).display().to_string();
    let files = ["nominal.toml", "a.csv", "b.csv", "c.csv", "r.html", "figures"].map(at);
    let [model, a, b, c, page, figures] = files.each_ref().map(String::as_str);
    let (code, out, err) = fdi(&[
        "explain",
        "--stable",
        "--model",
        model,
        "--train",
        a,
        b,
        "--holdout",
        c,
        "--report",
        page,
        "--figures",
        figures,
        "--quiet",
    ]);
    assert_eq!((code, err.as_str()), (0, ""));
    let html = text(Path::new(page));
    let (headings, answer) = outline(&html);
    assert_eq!(
        headings,
        [
            "What was found",
            "The residual, before and after",
            "Fault levels and numbers with a tolerance",
            "Recordings",
            "Hypotheses",
            "What is left open",
            "What would have been seen",
            "What this rests on",
        ]
    );
    assert_eq!(Some(answer), out.lines().next());
    assert!(answer.starts_with("The model misses Stribeck friction (E01)"), "{answer}");
    // each drawing says which recordings it was made from
    assert!(html.contains(&format!("From: {a}, {b} (fitted); {c} (held out)")), "{html}");
    assert_eq!(
        drawings(Path::new(figures)),
        [
            "explanation-faults.svg",
            "explanation-held-out.svg",
            "explanation-residual-others.svg",
            "explanation-residual.svg",
        ]
    );
    let Some(told) = told_of(Path::new(page)) else { return };
    assert_eq!(told, ["5 true 4 true true", "5 true 4 true true"]);
}

#[test]
fn an_experiment_has_its_report() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let (page, figures) = (at("r.html"), at("figures"));
    let (code, _, err) = fdi(&[
        "evaluate",
        "metaheuristics",
        "--conditions",
        "3",
        "--snapshots",
        "24",
        "--methods",
        "gls,de",
        "--max-evaluations",
        "60",
        "--report",
        &page,
        "--figures",
        &figures,
        "--quiet",
    ]);
    assert_eq!((code, err.as_str()), (0, ""));
    let html = text(Path::new(&page));
    let (headings, answer) = outline(&html);
    assert_eq!(
        headings,
        [
            "Methods",
            "Figures",
            "Faults, <code>gls</code>",
            "Faults, <code>de</code>",
            "What this rests on",
        ]
    );
    assert!(answer.starts_with("<code>gls</code> finds the levels of 3 "), "{answer}");
    // what the experiment does not say has no column
    assert!(!html.contains("coverage, %") && !html.contains("false alarms"), "{html}");
    assert_eq!(drawings(Path::new(&figures)), ["metaheuristics-convergence.svg"]);
    let Some(told) = told_of(Path::new(&page)) else { return };
    assert_eq!(told, ["3 true 1 true true", "3 true 1 true true"]);
}
