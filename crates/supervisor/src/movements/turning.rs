// SPDX-License-Identifier: Apache-2.0
//! Redirection of the followers of an SVV to its new writer.
use crate::instances::instance::Instance;
use crate::movements::carrier::Carrier;
use crate::movements::sequence::Movement;
use crate::wiring::connect::{Delays, HalfQueue, enter_queues, open, queues};
use crate::wiring::follow::{driving_svvs, due, step_drivers};
use kernel::{Op, SourceId};

impl Carrier<'_> {
    /// Redirects the followers of SVVs to an instance that begins to write them. `again` lists SVVs whose existing followers are
    /// redirected as well, because another block of the instance now writes them.
    pub fn turn_followers(&mut self, writer: u64, again: &[String]) -> Vec<Movement> {
        let shared = self.registry.shared_svvs(&self.instances[&writer].plan);
        self.turn_where(&shared, writer, |svv, followed| followed != writer || again.contains(svv))
    }

    /// Redirects all followers of these SVVs, which one instance writes, to the blocks that now write them.
    pub fn turn_all(&mut self, svvs: &[String], writer: u64) -> Vec<Movement> {
        self.turn_where(svvs, writer, |_, _| true)
    }

    /// Redirects each follower once, for all of its SVVs in `svvs` for which `turns` returns true, given the SVV and its current writer.
    fn turn_where(&mut self, svvs: &[String], writer: u64, turns: impl Fn(&String, u64) -> bool) -> Vec<Movement> {
        let turned = |instance: &Instance| -> Vec<String> {
            svvs.iter().filter(|svv| instance.followed.get(*svv).is_some_and(|followed| turns(svv, *followed))).cloned().collect()
        };
        let followers: Vec<(u64, Vec<String>)> = self.instances.values().map(|instance| (instance.id, turned(instance))).collect();
        followers.into_iter().filter(|(_, turned)| !turned.is_empty()).filter_map(|(follower, turned)| self.turn(follower, turned, writer)).collect()
    }

    /// Adds the SVVs of a follower that share a queue with one of `svvs`, before or after the redirection, because all values of one
    /// block arrive in the same queue.
    fn turn_together(&self, follower: &Instance, svvs: &mut Vec<String>) {
        loop {
            let mine = self.wiring.tables.values().flat_map(|table| &table.outlets).filter(|outlet| outlet.instance == Some(follower.id));
            let shared = mine.filter(|outlet| outlet.svvs.iter().any(|svv| svvs.contains(svv))).flat_map(|outlet| &outlet.svvs);
            let block = |svv: &str| self.registry.driver_of(svv).map(|writer| writer.block);
            let is_beside = |of: &String| block(of).is_some_and(|writer| svvs.iter().any(|svv| block(svv) == Some(writer)));
            let mut joined = shared.chain(follower.followed.keys().filter(|of| is_beside(of))).filter(|svv| !svvs.contains(svv));
            let Some(svv) = joined.next().cloned() else { return };
            svvs.push(svv);
        }
    }

    /// Redirects one follower of SVVs to another writer: to a queue of its own, or to the writer's activation if both are on the same
    /// source.
    fn turn(&mut self, follower: u64, mut svvs: Vec<String>, writer: u64) -> Option<Movement> {
        let mut instance = self.instances.remove(&follower)?;
        instance.followed.extend(svvs.iter().map(|svv| (svv.clone(), writer)));
        let turned = svvs.len();
        self.turn_together(&instance, &mut svvs);
        for svv in &svvs[turned..] {
            let writer = self.registry.driver_of(svv).map_or(writer, |of| of.instance);
            instance.followed.insert(svv.clone(), writer);
        }
        let is_turned = |svv: &str| svvs.iter().any(|turned| turned == svv);
        let mut sources = Vec::new();
        for (source, table) in &mut self.wiring.tables {
            let before = (table.outlets.len(), table.inlets.len());
            table.outlets.retain(|outlet| !(outlet.instance == Some(follower) && outlet.svvs.iter().any(|svv| is_turned(svv))));
            table.inlets.retain(|inlet| !(inlet.instance == Some(follower) && inlet.svvs.iter().any(|svv| is_turned(svv))));
            if before != (table.outlets.len(), table.inlets.len()) {
                sources.push(*source);
            }
        }
        let (plan, installed) = (instance.plan.clone(), &mut instance.installed);
        let delays: Delays = installed.delays.iter().map(|(_, block, item, cell)| ((*block, *item), cell.clone())).collect();
        let made = open(queues(self.registry, self.host, &plan, &installed.block_source, &installed.cells, &delays, Some(&svvs)));
        installed.gates.retain(|gate| !gate.svv.as_deref().is_some_and(is_turned));
        installed.gates.extend(made.iter().flat_map(HalfQueue::gates));
        sources.extend(enter_queues(self.wiring, made, follower, installed));
        let mut follows = Vec::new();
        for (index, activation) in plan.activations.iter().enumerate() {
            if activation.blocks.iter().any(|block| driving_svvs(&plan, *block).any(is_turned)) {
                let source = installed.activation_source[index];
                let due = due(self.registry, &plan, &installed.activations, &installed.gates, (index, source));
                follows.push((source, installed.activations[index].follow(due)));
                sources.push(source);
            }
        }
        for (index, source) in installed.block_source.iter().enumerate() {
            let drivers = step_drivers(&plan, installed, index, self.registry);
            let id = installed.blocks[index].id();
            if let Some(step) = self.wiring.tables.get_mut(source).and_then(|table| table.steps.iter_mut().find(|step| step.id == id)) {
                step.drivers = drivers;
            }
        }
        self.instances.insert(follower, instance);
        Some(Movement::Follow { sources, follows })
    }

    /// Returns new tables for these sources, each with the operations that make the activations follow their new drivers.
    pub fn follow_ops(&self, mut sources: Vec<SourceId>, follows: Vec<(SourceId, Op)>) -> Vec<(SourceId, Vec<Op>)> {
        sources.sort();
        sources.dedup();
        let mut scripts: Vec<(SourceId, Vec<Op>)> = sources.into_iter().map(|source| (source, vec![self.table_op(source)])).collect();
        for (source, op) in follows {
            if let Some((_, ops)) = scripts.iter_mut().find(|(of, _)| *of == source) {
                // Must precede the table: its scratch has the order that the new drivers require.
                ops.insert(0, op);
            }
        }
        scripts
    }
}
