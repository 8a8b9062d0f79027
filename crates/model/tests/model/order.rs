// SPDX-License-Identifier: Apache-2.0
//! Order: hard edges hold, soft ones unless they form a cycle, and existing elements never move.
use model::order::{find_cycle, insert, sort};
use proptest::prelude::*;

fn position(order: &[usize]) -> Vec<usize> {
    let mut position = vec![0; order.len()];
    order.iter().enumerate().for_each(|(at, element)| position[*element] = at);
    position
}

#[test]
fn small_orders() {
    assert_eq!(sort(4, &[], &[]).unwrap().order, [0, 1, 2, 3]);
    assert_eq!(sort(4, &[(3, 0)], &[]).unwrap().order, [1, 2, 3, 0]);
    assert_eq!(sort(3, &[], &[(2, 0)]).unwrap().order, [1, 2, 0]);
    let sorted = sort(3, &[(0, 1)], &[(1, 0), (2, 0)]).unwrap();
    assert_eq!((sorted.order, sorted.against), (vec![2, 0, 1], vec![(1, 0)]));
    assert_eq!(sort(3, &[(0, 1), (1, 2), (2, 1)], &[]).unwrap_err(), [1, 2]);
    assert_eq!(sort(2, &[(1, 1)], &[]).unwrap_err(), [1]);
}

#[test]
fn new_elements_come_as_late_as_they_may() {
    assert_eq!(insert(&['a', 'b'], &['x', 'y'], &[], &[]).unwrap(), ['a', 'b', 'x', 'y']);
    assert_eq!(insert(&['a', 'b', 'c'], &['x', 'y'], &[('y', 'c')], &[]).unwrap(), ['a', 'b', 'y', 'c', 'x']);
    assert_eq!(insert(&['a', 'b', 'c'], &['x', 'y'], &[('x', 'y')], &[('y', 'b')]).unwrap(), ['a', 'x', 'y', 'b', 'c']);
    assert_eq!(insert(&['a', 'b'], &['x'], &[('b', 'x')], &[('x', 'a')]).unwrap(), ['a', 'b', 'x']);
    let mut cycle = insert(&['a', 'b'], &['x'], &[('b', 'x'), ('x', 'a')], &[]).unwrap_err();
    cycle.sort_unstable();
    assert_eq!(cycle, ['a', 'b', 'x']);
}

fn edges(count: usize, most: usize) -> impl Strategy<Value = Vec<(usize, usize)>> {
    prop::collection::vec((0..count, 0..count), 0..most)
}

proptest! {
    #[test]
    fn a_sorted_order_holds(all in edges(30, 60), soft in edges(30, 60)) {
        // Edges up a random but fixed permutation form no cycle.
        let key = |e: usize| (e * 17 + 5) % 30;
        let hard: Vec<_> = all.into_iter().filter(|(a, b)| key(*a) < key(*b)).collect();
        let sorted = sort(30, &hard, &soft).unwrap();
        let at = position(&sorted.order);
        prop_assert!(hard.iter().all(|(a, b)| at[*a] < at[*b]));
        for (a, b) in &soft {
            prop_assert_eq!(a != b && at[*a] > at[*b], sorted.against.contains(&(*a, *b)));
        }
        // Every soft edge that was dropped lies on a cycle.
        for (a, b) in &sorted.against {
            let mut reached = [false; 30];
            let mut work = vec![*b];
            while let Some(e) = work.pop() {
                if !std::mem::replace(&mut reached[e], true) {
                    work.extend(hard.iter().chain(&soft).filter(|(from, _)| *from == e).map(|(_, to)| *to));
                }
            }
            prop_assert!(reached[*a]);
        }
    }

    #[test]
    fn a_cycle_is_a_cycle(hard in edges(12, 30)) {
        match sort(12, &hard, &[]) {
            Ok(sorted) => {
                let at = position(&sorted.order);
                prop_assert!(hard.iter().all(|(a, b)| at[*a] < at[*b]));
            }
            Err(cycle) => {
                for (at, from) in cycle.iter().enumerate() {
                    prop_assert!(hard.contains(&(*from, cycle[(at + 1) % cycle.len()])));
                }
                prop_assert_eq!(find_cycle(12, &hard), Some(cycle));
            }
        }
    }

    #[test]
    fn an_insertion_moves_nothing(existing in Just((0..20).collect::<Vec<usize>>()).prop_shuffle(), count in 0_usize..10, hard in edges(30, 30), soft in edges(30, 30)) {
        let new: Vec<usize> = (20..20 + count).collect();
        // Hard edges between new and existing elements, consistent with a known good order: each new element directly after existing[new
        // - 20].
        let place = |e: usize| existing.iter().position(|x| *x == e).map_or_else(|| 2 * (e - 20) + 1, |at| 2 * at);
        let there = |e: &usize| *e < 20 + count;
        let hard: Vec<_> = hard.into_iter().filter(|(a, b)| there(a) && there(b) && place(*a) < place(*b)).collect();
        let order = insert(&existing, &new, &hard, &soft).unwrap();
        prop_assert_eq!(order.iter().copied().filter(|e| *e < 20).collect::<Vec<_>>(), existing);
        prop_assert_eq!(order.len(), 20 + count);
        let mut all = vec![usize::MAX; 30];
        order.iter().enumerate().for_each(|(at, e)| all[*e] = at);
        prop_assert!(hard.iter().all(|(a, b)| all[*a] < all[*b]));
    }
}
