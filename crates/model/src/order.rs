// SPDX-License-Identifier: Apache-2.0
//! Order of a firing: determined by synchronous edges (hard), then by asynchronous edges (soft) unless they form a cycle, then by
//! declaration order.
//!
//! All steps take linear time except for one priority queue.
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use std::hash::Hash;

/// An order, and the soft edges that it violates.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SortedOrder {
    pub order: Vec<usize>,
    pub against: Vec<(usize, usize)>,
}

/// Sorts `0..count` by the edges (before, after); ties are broken by number.
///
/// # Errors
/// Returns a cycle of hard edges, in which each element precedes the next, and the last precedes the first.
pub fn sort(count: usize, hard: &[(usize, usize)], soft: &[(usize, usize)]) -> Result<SortedOrder, Vec<usize>> {
    let mut edges: Vec<Edge> = Vec::with_capacity(hard.len() + soft.len());
    edges.extend(hard.iter().map(|&(from, to)| Edge { from, to, hard: true }));
    edges.extend(soft.iter().filter(|(from, to)| from != to).map(|&(from, to)| Edge { from, to, hard: false }));
    let out = Adjacency::new(count, &edges);
    let order = match kahn(count, &edges, &out, &[]) {
        Ok(order) => order,
        Err(_) => {
            // Soft edges between different components cannot form a cycle and are kept. Soft edges within a component may be dropped.
            let component = components(count, &edges, &out);
            for edge in &mut edges {
                edge.hard |= component[edge.from] != component[edge.to];
            }
            match kahn(count, &edges, &out, &component) {
                Ok(order) => order,
                Err(_) => return Err(cycle(count, hard)),
            }
        }
    };
    let mut position = vec![0; count];
    for (at, &element) in order.iter().enumerate() {
        position[element] = at;
    }
    let against = soft.iter().copied().filter(|&(from, to)| from != to && position[from] > position[to]).collect();
    Ok(SortedOrder { order, against })
}

/// Inserts new elements into an existing order, which never changes. Hard edges (before, after) are always respected, soft ones if
/// possible; subject to that, a new element is placed as late as possible, and after the new elements that precede it in `new`.
///
/// # Errors
/// Returns the elements of a cycle formed by hard edges and the existing order.
pub fn insert<K: Copy + Eq + Hash>(existing: &[K], new: &[K], hard: &[(K, K)], soft: &[(K, K)]) -> Result<Vec<K>, Vec<K>> {
    let keys: Vec<K> = existing.iter().chain(new).copied().collect();
    if hard.is_empty() && soft.is_empty() {
        return Ok(keys);
    }
    // Work backwards: assign the last position first, to the last new element that nothing waits for. All numbers are therefore
    // mirrored.
    let count = keys.len();
    let number: HashMap<K, usize> = keys.iter().enumerate().map(|(at, key)| (*key, count - 1 - at)).collect();
    let mirrored = |edges: &[(K, K)]| -> Vec<(usize, usize)> { edges.iter().filter_map(|(from, to)| Some((*number.get(to)?, *number.get(from)?))).collect() };
    let mut chained = mirrored(hard);
    chained.extend((1..existing.len()).map(|at| (count - 1 - at, count - at)));
    let key_of = |element: usize| keys[count - 1 - element];
    match sort(count, &chained, &mirrored(soft)) {
        Ok(sorted) => Ok(sorted.order.into_iter().rev().map(key_of).collect()),
        Err(cycle) => Err(cycle.into_iter().rev().map(key_of).collect()),
    }
}

struct Edge {
    from: usize,
    to: usize,
    hard: bool,
}

/// Outgoing edges of all elements in one array, indexed by element.
struct Adjacency {
    start: Vec<usize>,
    edges: Vec<usize>,
}

impl Adjacency {
    fn new(count: usize, edges: &[Edge]) -> Adjacency {
        let mut start = vec![0; count + 1];
        for edge in edges {
            start[edge.from + 1] += 1;
        }
        for at in 0..count {
            start[at + 1] += start[at];
        }
        let mut next = start.clone();
        let mut sorted = vec![0; edges.len()];
        for (index, edge) in edges.iter().enumerate() {
            sorted[next[edge.from]] = index;
            next[edge.from] += 1;
        }
        Adjacency { start, edges: sorted }
    }

    fn of(&self, element: usize) -> &[usize] {
        &self.edges[self.start[element]..self.start[element + 1]]
    }
}

/// Sorts by Kahn's algorithm, lowest number first. If `component` is not empty, soft edges within a component are dropped when no element
/// is free. The error contains the elements that could not be placed.
fn kahn(count: usize, edges: &[Edge], out: &Adjacency, component: &[usize]) -> Result<Vec<usize>, Vec<usize>> {
    let (mut hard, mut soft) = (vec![0_u32; count], vec![0_u32; count]);
    for edge in edges {
        if edge.hard { hard[edge.to] += 1 } else { soft[edge.to] += 1 }
    }
    let gives_way = !component.is_empty();
    let mut free: BinaryHeap<Reverse<usize>> = (0..count).filter(|&e| hard[e] + soft[e] == 0).map(Reverse).collect();
    let mut waiting: BinaryHeap<Reverse<usize>> = BinaryHeap::new();
    if gives_way {
        waiting.extend((0..count).filter(|&e| hard[e] == 0 && soft[e] > 0).map(Reverse));
    }
    let mut placed = vec![false; count];
    let mut order = Vec::with_capacity(count);
    while let Some(Reverse(element)) = free.pop().or_else(|| waiting.pop()) {
        if std::mem::replace(&mut placed[element], true) {
            continue;
        }
        order.push(element);
        for &index in out.of(element) {
            let edge = &edges[index];
            if edge.hard {
                hard[edge.to] -= 1
            } else {
                soft[edge.to] -= 1
            }
            if hard[edge.to] == 0 && !placed[edge.to] {
                match soft[edge.to] {
                    0 => free.push(Reverse(edge.to)),
                    _ if gives_way && edge.hard => waiting.push(Reverse(edge.to)),
                    _ => {}
                }
            }
        }
    }
    if order.len() == count { Ok(order) } else { Err((0..count).filter(|&e| !placed[e]).collect()) }
}

/// Returns the strongly connected component of each element (Tarjan, without recursion).
fn components(count: usize, edges: &[Edge], out: &Adjacency) -> Vec<usize> {
    const NONE: usize = usize::MAX;
    let (mut number, mut low, mut component) = (vec![NONE; count], vec![0; count], vec![NONE; count]);
    let (mut stack, mut path): (Vec<usize>, Vec<(usize, usize)>) = (Vec::new(), Vec::new());
    let (mut numbers, mut found) = (0, 0);
    for root in 0..count {
        if number[root] != NONE {
            continue;
        }
        path.push((root, 0));
        while let Some(&(element, at)) = path.last() {
            if at == 0 {
                number[element] = numbers;
                low[element] = numbers;
                numbers += 1;
                stack.push(element);
            }
            if let Some(&index) = out.of(element).get(at) {
                path.last_mut().expect("it was there a line above").1 += 1;
                let to = edges[index].to;
                if number[to] == NONE {
                    path.push((to, 0));
                } else if component[to] == NONE {
                    low[element] = low[element].min(number[to]);
                }
                continue;
            }
            path.pop();
            if let Some(&(parent, _)) = path.last() {
                low[parent] = low[parent].min(low[element]);
            }
            if low[element] == number[element] {
                while let Some(member) = stack.pop() {
                    component[member] = found;
                    if member == element {
                        break;
                    }
                }
                found += 1;
            }
        }
    }
    component
}

/// Returns a cycle of hard edges. There must be one.
fn cycle(count: usize, hard: &[(usize, usize)]) -> Vec<usize> {
    let edges: Vec<Edge> = hard.iter().map(|&(from, to)| Edge { from, to, hard: true }).collect();
    let left = kahn(count, &edges, &Adjacency::new(count, &edges), &[]).err().unwrap_or_default();
    let mut is_left = vec![false; count];
    left.iter().for_each(|&element| is_left[element] = true);
    let mut before = vec![usize::MAX; count];
    for &(from, to) in hard.iter().filter(|(from, to)| is_left[*from] && is_left[*to]) {
        before[to] = from;
    }
    // Every remaining element waits for another remaining one, so walking back visits some element twice.
    let Some(&first) = left.first() else { return Vec::new() };
    let mut at = first;
    let mut seen = vec![false; count];
    while !std::mem::replace(&mut seen[at], true) {
        at = before[at];
    }
    let mut found = vec![at];
    let mut next = before[at];
    while next != at {
        found.push(next);
        next = before[next];
    }
    found.reverse();
    let least = found.iter().enumerate().min_by_key(|(_, element)| **element).map_or(0, |(at, _)| at);
    found.rotate_left(least);
    found
}

/// Returns a cycle of these edges on `0..count`, if any.
pub fn find_cycle(count: usize, edges: &[(usize, usize)]) -> Option<Vec<usize>> {
    sort(count, edges, &[]).err()
}
