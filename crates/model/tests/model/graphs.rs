// SPDX-License-Identifier: Apache-2.0
//! Checks that random valid graphs are accepted, and that every synchronous edge follows the order of a firing.
use crate::common::*;
use model::interface::Mode;
use model::plan::Binding;
use proptest::prelude::*;
use serde_json::{Value, json};

/// Returns gains in layers below one signal, declared in random order, some of them in nested graphs.
fn graph(parents: &[usize], names: &[usize], nested: bool) -> Value {
    let label = |at: usize| format!("b{}", names[at]);
    let mut declared: Vec<usize> = (0..names.len()).collect();
    declared.sort_by_key(|at| names[*at]);
    let mut blocks = serde_json::Map::new();
    for at in declared {
        let subroutine = if at == 0 { "lib.signal" } else { "lib.gain" };
        let block = match (at, nested && at % 3 == 1) {
            (_, false) => json!({"subroutine": subroutine}),
            (_, true) => {
                json!({"graph": {"name": "inner", "blocks": {"g": {"block": {"subroutine": subroutine}}}, "inputs": {"u": ["g.u"]}, "outputs": {"y": ["g.y"]}}})
            }
        };
        blocks.insert(label(at), json!({"block": block}));
    }
    let mut cells = serde_json::Map::new();
    for at in 0..names.len() {
        let mut ports = vec![format!("{}.y", label(at))];
        ports.extend((1..names.len()).filter(|child| parents[*child] % *child == at).map(|child| format!("{}.u", label(child))));
        cells.insert(format!("c{at}"), json!(ports));
    }
    json!({"name": "g", "blocks": blocks, "cells": cells})
}

proptest! {
    #[test]
    fn random_trees_of_blocks_are_one_activation_in_order(
        parents in prop::collection::vec(any::<u16>().prop_map(usize::from), 20),
        names in Just((0..20).collect::<Vec<usize>>()).prop_shuffle(),
        nested in any::<bool>(),
    ) {
        let graph = graph(&parents, &names, nested);
        prop_assert!(check_graph_json(graph.clone()).is_empty());
        let verb = json!({"name": "v", "blocks": {"g": {"block": {"graph": graph}}}, "command_lists": start(&["+g 1ms"])});
        let plan = apply_json(verb, json!({})).unwrap_or_else(|refusals| panic!("refused: {}", texts(&refusals)));
        prop_assert_eq!(plan.activations.len(), 1);
        let order = &plan.order[0].1;
        prop_assert_eq!(order.len(), 20);
        let at = |block: usize| order.iter().position(|b| *b == block).unwrap();
        for (reader, block) in plan.blocks.iter().enumerate() {
            for driver in &block.drivers {
                prop_assert!(at(*driver) < at(reader));
            }
            for bound in block.bindings.iter().filter(|bound| bound.mode == Mode::Synchronous) {
                let Binding::Cell(cell) = bound.binding else { panic!("no lists here") };
                prop_assert!(plan.cells[cell].writers.len() == 1);
            }
        }
    }
}
