// SPDX-License-Identifier: Apache-2.0
//! The library as a module: its registered blocks, and a motion made by them through the ABI.
use opengpac::read::{BlockFace, Kind, TypeFace};
use opengpac::trial::{Fault, Trial};
use std::path::Path;

fn faces() -> Vec<BlockFace> {
    let types: Vec<TypeFace> = library::types().into_iter().map(|ty| TypeFace::read(ty).expect("a type of the derive")).collect();
    library::blocks().into_iter().map(|descriptor| BlockFace::read(descriptor, &types).expect("a descriptor of the derive")).collect()
}

fn block(name: &str) -> Trial {
    Trial::of(faces().into_iter().find(|face| face.name == name).expect("it is registered"))
}

fn sized(name: &str, n: u32) -> Trial {
    let mut trial = block(name);
    trial.set("n", &n.to_ne_bytes()).expect("a size within its limits");
    trial
}

#[test]
fn every_file_of_the_folder_is_a_block_of_that_name() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/blocks");
    let entries = |folder: &Path| std::fs::read_dir(folder).expect("a folder").map(|e| e.expect("an entry").path()).collect::<Vec<_>>();
    let mut files: Vec<String> = entries(&folder)
        .into_iter()
        .flat_map(|path| if path.is_dir() { entries(&path) } else { vec![path] })
        .map(|path| path.file_stem().expect("a name").to_string_lossy().into_owned())
        .collect();
    files.sort();
    let names: Vec<String> = faces().into_iter().map(|face| face.name).collect();
    assert_eq!(names, files);
}

#[test]
fn every_block_says_what_it_does_and_every_item_what_it_is() {
    for face in faces() {
        assert!(face.doc.contains(['=', '|']), "{}: its first sentence has the equation: {}", face.name, face.doc);
        for item in &face.items {
            assert!(!item.doc.is_empty(), "{}.{}", face.name, item.name);
        }
    }
}

/// Checks the names that programs rely on.
#[test]
fn the_names_of_the_interface_stay() {
    let expected = [
        ("read_channel", "channel y"),
        ("write_channel", "u channel"),
        (
            "pid",
            "setpoint measured feedforward effort error kp ki kd limit interpolation following_error manual manual_effort least setpoint_weight \
             derivative_weight derivative_time anti_windup tracking_time",
        ),
        (
            "joint_servo",
            "setpoint setpoint_velocity setpoint_acceleration setpoint_time position velocity bias offset homed effort reference reference_velocity limited braking lost error_max kp ki kd limit interpolation position_min \
             position_max speed_max acceleration_max jerk_max needs_home ripple_max following_error unstable gap",
        ),
        (
            "joint_reference",
            "setpoint setpoint_velocity setpoint_acceleration setpoint_time position velocity offset homed goal error reference reference_velocity limited braking lost error_max period position_min position_max speed_max acceleration_max jerk_max \
             needs_home following_error gap",
        ),
        (
            "motion_generator",
            "n start start_velocity last_velocity last_acceleration last_time braking goal speed fastest acceleration jerk position_min position_max override \
             cell_override gap_max holding setpoint velocity setpoint_acceleration setpoint_time lost target complete duration lead relative finished held \
             gap",
        ),
        (
            "velocity_generator",
            "n start start_velocity last_velocity last_acceleration last_time braking velocity acceleration jerk position_min position_max override cell_override \
             gap_max holding setpoint setpoint_velocity setpoint_acceleration setpoint_time lost lead reverse in_velocity stopped held at_limit gap",
        ),
        (
            "gear_generator",
            "master start start_velocity last_velocity last_acceleration last_time braking ratio speed acceleration deceleration jerk position_min position_max gap_max \
             setpoint velocity setpoint_velocity setpoint_acceleration setpoint_time lost engaged lead in_gear at_limit too_fast gap",
        ),
        ("heartbeat", "beat lost age limit client late"),
        ("capture", "n level u captured on off"),
        ("set_position", "n captured position offset commanded new_offset new_commanded homed shift"),
        ("offset", "u offset y"),
        ("trajectory_planner", "n start goal speed speed_max acceleration_max jerk_max position_min position_max target coefficients duration"),
        ("setpoint_generator", "n coefficients setpoint velocity complete lead finished"),
        ("in_position", "n sensed goal complete error tolerance dwell done"),
        ("force_guard", "force magnitude above"),
        ("time_limit", "remaining limit expired"),
        ("lowpass", "u y alpha"),
        ("gain", "u y k"),
        ("limit", "u y low high limited"),
        ("sum", "n u y w"),
        ("forward_kinematics", "n q pose chain"),
        ("jacobian", "n q jacobian least chain"),
        ("inverse_dynamics", "n q velocity acceleration effort gravity_effort chain links gravity"),
        (
            "inverse_kinematics",
            "n goal near position_min position_max q reached position_error angle_error chain tolerance angle_tolerance orientation attempts unreachable limit singular",
        ),
        ("differential_kinematics", "n pose start speed_max position_min position_max setpoint behind turned chain slowed lost"),
        (
            "tool_velocity_generator",
            "n start start_velocity last_velocity last_acceleration last_time braking velocity angular_velocity in_tool distance acceleration override \
             cell_override holding gap_max speed_max acceleration_max jerk_max position_min position_max setpoint setpoint_velocity setpoint_acceleration \
             setpoint_time lead chain finished held blocked gap",
        ),
        (
            "arc_planner",
            "n start start_velocity last_velocity last_acceleration last_time braking goal speed angular_speed speed_max acceleration_max position_min position_max \
             line target duration chain acceleration jerk angular_acceleration via angle orientation no_arc slowest lead waits unreachable limit singular",
        ),
        (
            "line_planner",
            "n start start_velocity last_velocity last_acceleration last_time braking goal speed angular_speed speed_max acceleration_max position_min position_max \
             line target duration chain acceleration jerk angular_acceleration angular_jerk slowest lead waits unreachable limit singular",
        ),
        (
            "line_generator",
            "n line start start_velocity last_velocity last_acceleration last_time braking override cell_override holding gap_max speed_max acceleration_max \
             jerk_max setpoint setpoint_velocity setpoint_acceleration setpoint_time lost pose progress complete lead chain finished held singular gap",
        ),
        (
            "polyline_planner",
            "n start start_velocity last_velocity last_acceleration last_time braking poses blend speed angular_speed speed_max acceleration_max position_min \
             position_max path target duration refused chain acceleration angular_acceleration slowest lead waits unreachable limit singular",
        ),
        (
            "polyline_generator",
            "n path start start_velocity last_velocity last_acceleration last_time braking override cell_override holding gap_max speed_max acceleration_max \
             jerk_max setpoint setpoint_velocity setpoint_acceleration setpoint_time lost pose progress complete lead chain finished held singular gap",
        ),
        (
            "long_path_planner",
            "n start start_velocity last_velocity last_acceleration last_time braking points blend speed speed_max acceleration_max position_min position_max path \
             target duration refused lead waits limit",
        ),
        (
            "queue_generator",
            "n start start_velocity last_velocity last_acceleration last_time braking moves rate override cell_override holding gap_max speed_max \
             acceleration_max jerk_max position_min position_max setpoint setpoint_velocity setpoint_acceleration setpoint_time progress target complete \
             path lead chain held refused gap",
        ),
        ("queue_outputs", "n progress start y"),
        ("payload_effort", "n q effort held chain mass centre gravity rate"),
        ("channel_sum", "channel u y"),
        ("flag", "y value"),
        (
            "path_planner",
            "n start start_velocity last_velocity last_acceleration last_time braking points blend speed speed_max acceleration_max position_min position_max path \
             target duration refused lead waits limit",
        ),
        (
            "path_generator",
            "n path start start_velocity last_velocity last_acceleration last_time braking override cell_override holding gap_max acceleration_max jerk_max \
             setpoint velocity setpoint_acceleration setpoint_time lost progress complete lead finished held gap",
        ),
    ];
    for (name, items) in expected {
        let face = faces().into_iter().find(|face| face.name == name).expect(name);
        let found: Vec<&str> = face.items.iter().filter(|item| item.kind != Kind::State).map(|item| item.name.as_str()).collect();
        assert_eq!(found.join(" "), items, "{name}");
    }
}

#[test]
fn planner_generator_and_in_position_make_a_motion() {
    let mut planner = sized("trajectory_planner", 3);
    planner.set_numbers("start", &[0.0, 1.0, -1.0]).unwrap();
    planner.set_numbers("goal", &[0.5, 1.0, -2.0]).unwrap();
    planner.run().unwrap();
    assert_eq!(planner.numbers("target").unwrap(), [0.5, 1.0, -2.0]);
    let mut generator = sized("setpoint_generator", 3);
    generator.period_ns = 20_000_000;
    generator.set("coefficients", &planner.get("coefficients").unwrap()).unwrap();
    let mut near = sized("in_position", 3);
    near.set_numbers("goal", &[0.5, 1.0, -2.0]).unwrap();
    let (mut finished_at, mut done_at) = (None, None);
    for k in 0..200 {
        generator.run().unwrap();
        // Simulates a perfect arm.
        near.set_numbers("sensed", &generator.numbers("setpoint").unwrap()).unwrap();
        near.set_number("complete", generator.number("complete").unwrap()).unwrap();
        near.run().unwrap();
        finished_at = finished_at.or(generator.reported().contains(&"finished".to_string()).then_some(k));
        done_at = done_at.or(near.reported().contains(&"done".to_string()).then_some(k));
    }
    let last = (planner.number("duration").unwrap() / 0.02).ceil() as i32;
    assert_eq!((finished_at, done_at), (Some(last), Some(last + 4)), "its dwell is five invocations");
    assert_eq!(generator.numbers("setpoint").unwrap(), [0.5, 1.0, -2.0]);
}

#[test]
fn a_fault_stores_nothing() {
    let mut planner = sized("trajectory_planner", 1);
    planner.set_numbers("start", &[0.0]).unwrap();
    planner.set_numbers("goal", &[1.0]).unwrap();
    planner.run().unwrap();
    let before = planner.get("coefficients").unwrap();
    planner.set_numbers("goal", &[f64::NAN]).unwrap();
    assert!(matches!(planner.run(), Err(Fault::Returned(1))));
    assert_eq!(planner.get("coefficients").unwrap(), before);
    assert!(matches!(block("setpoint_generator").run(), Err(Fault::Returned(1))), "no plan yet");
}

/// A bad sample must not poison a filter or an integral.
#[test]
fn after_a_sample_that_is_not_finite_filters_go_on() {
    let mut filter = block("lowpass");
    filter.set_number("u", 1.0).unwrap();
    filter.run().unwrap();
    filter.set_number("u", f64::NAN).unwrap();
    assert!(matches!(filter.run(), Err(Fault::NonFinite { .. })));
    filter.set_number("u", 1.0).unwrap();
    filter.run().unwrap();
    assert!((filter.number("y").unwrap() - 0.19).abs() < 1e-12);
    let mut servo = block("joint_servo");
    servo.set_number("ki", 1.0).unwrap();
    servo.run().unwrap();
    servo.set_number("position", f64::NAN).unwrap();
    assert!(servo.run().is_err());
    servo.set_number("position", 0.25).unwrap();
    servo.run().unwrap();
    assert!(servo.number("effort").unwrap().is_finite());
}

/// Sorting, comparing and clamping lose a NaN unless the block handles it.
#[test]
fn a_sample_that_is_no_number_is_a_fault_of_every_block_and_the_next_goes_on() {
    let is_input = |face: &BlockFace, name: &str| face.items.iter().any(|item| item.name == name && item.kind == Kind::Input && item.type_text == "double");
    let mut tried = 0;
    for face in faces().into_iter().filter(|face| is_input(face, "u")) {
        let (name, inputs) = (face.name.clone(), face.items.iter().map(|item| item.name.clone()).filter(|item| is_input(&face, item)).collect::<Vec<_>>());
        let mut trial = Trial::of(face);
        for input in &inputs {
            trial.set_number(input, 1.0).unwrap();
        }
        for u in [1.0, 0.5, f64::NAN, 1.0, f64::NAN, 0.25] {
            trial.set_number("u", u).unwrap();
            assert_eq!(trial.run().is_ok(), u.is_finite(), "{name} at {u}: {:?}", trial.run());
        }
        tried += 1;
    }
    assert!(tried > 30, "{tried}");
}
