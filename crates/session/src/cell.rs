// SPDX-License-Identifier: Apache-2.0
//! Calls on a cell: emergency stop, pause, modes, alarms, and what changes while it runs.
use crate::arguments::{Answer, Arguments, done, told};
use model::refusal::Place;
use supervisor::{Alarm, AlarmText, Mode, System};

pub(crate) fn cell(system: &System, name: &str, a: &mut Arguments) -> Answer {
    match name {
        "emergency_stop" => {
            let reason = a.take::<String>("reason")?;
            a.none_left()?;
            done(system.emergency_stop(&reason))
        }
        "emergency_stop_input" => {
            let (device, channel, at_zero) = (a.take::<String>("device")?, a.take::<String>("channel")?, a.or("at_zero")?);
            a.none_left()?;
            done(system.emergency_stop_input(&device, &channel, at_zero))
        }
        "reset" => {
            a.none_left()?;
            done(system.reset())
        }
        "resume_program" => {
            let devices = a.or::<Option<Vec<String>>>("devices")?;
            a.none_left()?;
            told(system.resume_program(devices.as_deref())?.into_iter().map(|(_, name)| name).collect::<Vec<_>>())
        }
        "mode" => a.none_left().and_then(|()| told(system.mode())),
        "set_mode" => {
            let mode = a.take::<Mode>("mode")?;
            a.none_left()?;
            done(system.set_mode(mode))
        }
        "enabling_switch" => {
            let (device, channel) = (a.take::<String>("device")?, a.take::<String>("channel")?);
            a.none_left()?;
            done(system.enabling_switch(&device, &channel))
        }
        _ => alarms(system, name, a),
    }
}

fn alarms(system: &System, name: &str, a: &mut Arguments) -> Answer {
    match name {
        "alarms" => a.none_left().and_then(|()| told(system.alarms_json())),
        "define_alarm" => {
            let code = a.take::<String>("code")?;
            done(system.define_alarm(&code, a.whole::<AlarmText>()?))
        }
        "raise_alarm" => {
            let (code, source, text) = (a.take::<String>("code")?, a.or::<String>("source")?, a.or::<String>("text")?);
            a.none_left()?;
            done(system.raise_alarm(&code, &source, &text))
        }
        "clear_alarm" => {
            let (code, source) = (a.take::<String>("code")?, a.or::<Option<String>>("source")?);
            a.none_left()?;
            told(system.clear_alarm(&code, source.as_deref())?)
        }
        "acknowledge_alarms" => {
            let number = a.or::<Option<u64>>("number")?;
            a.none_left()?;
            told(system.acknowledge_alarms(number)?)
        }
        "restore_alarms" => {
            let history = a.take::<Vec<Alarm>>("history")?;
            a.none_left()?;
            done(system.restore_alarms(history))
        }
        _ => changes(system, name, a),
    }
}

fn changes(system: &System, name: &str, a: &mut Arguments) -> Answer {
    match name {
        "raises" => {
            let (device, channel, source) = (a.take::<String>("device")?, a.take::<String>("channel")?, a.take::<String>("source")?);
            let place = a.or::<Option<Place>>("place")?;
            a.none_left()?;
            done(system.raise(&device, &channel, &source, place))
        }
        "exchange_verb" => {
            let (device, verb, place) = (a.take::<String>("device")?, a.take::<String>("verb")?, a.or::<Option<Place>>("place")?);
            a.none_left()?;
            done(system.exchange_verb(&device, &verb, place))
        }
        "compose" => told(system.compose(&a.whole()?)?),
        "verbs" => a.none_left().and_then(|()| told(system.verbs_json())),
        "installed" => a.none_left().and_then(|()| told(system.installed_json())),
        "verb_form" => {
            let verb = a.take::<String>("name")?;
            a.none_left()?;
            told(system.verb_form_json(&verb)?)
        }
        "geometry" => {
            let device = a.take::<String>("device")?;
            a.none_left()?;
            told(system.geometry_json(&device)?)
        }
        "configuration" => a.none_left().and_then(|()| told(system.configuration_json())),
        _ => Ok(None),
    }
}
