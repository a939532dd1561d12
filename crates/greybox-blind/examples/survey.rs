//! Draws some cases of a class and prints what is true of them: `survey CLASS COUNT [FROM [FOLDER]]`;
//! with a folder the recordings are written to `FOLDER/NUMBER`.
#![expect(clippy::print_stdout, reason = "it is what the example is for")]

use std::path::Path;

use greybox_blind::{Case, Class};

fn main() -> std::io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let class = arguments.first().and_then(|name| Class::find(name)).unwrap_or(Class::Single);
    let number = |n: usize| arguments.get(n).and_then(|text| text.parse().ok());
    let (count, from): (u64, u64) = (number(1).unwrap_or(8), number(2).unwrap_or(0));
    for seed in from..from + count {
        let case = match Case::draw(seed << 16 | seed, class) {
            Ok(case) => case,
            Err(error) => {
                println!("{error}");
                continue;
            }
        };
        println!("{}", case.truth_json());
        if let Some(folder) = arguments.get(3) {
            case.write(&Path::new(folder).join(seed.to_string()))?;
        }
    }
    Ok(())
}
