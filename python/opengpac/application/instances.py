# SPDX-License-Identifier: Apache-2.0
"""Verb instances. An instance is created, runs and may be suspended, and ends; each `start` runs it again, until it is deleted."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Generator, Mapping
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar, cast

from .. import checking
from ..checking.planning import plan
from ..errors import CallError, Error, InvalidState, gone, refusals, refuse
from ..refusals.argument_types import all_taking
from ..refusals.declared_names import DeclaredNames
from ..values.encoding import plain
from ..values.quantities import Quantity, optional_ns, span_ns
from ..values.tables import Table, TableDisplay
from . import progress, waiting
from .application import application_json, arguments_json, bind, options_json, system_for, values_json
from .prepared_call import PreparedCall
from .reports import terminated

if TYPE_CHECKING:
    from ..definition.verbs import Verb
    from ..system.system import System

R = TypeVar("R", covariant=True)

_read = json.JSONDecoder().raw_decode


@all_taking
class VerbInstance(TableDisplay, DeclaredNames, Generic[R]):
    """A verb applied to its arguments. It can be awaited; as a context manager it halts and deletes itself on exit.

    `verb.asynch(...)` creates an instance that `wait` deletes; `verb.new_instance(...)` creates one that can be started any number of
    times.

    `verb` is the applied verb, `system` is the system in which it runs, and `identity` is its number in that system; numbers are
    never reused.

    The life cycle is created → running ⇄ suspended → ended, repeated with each `start`, until the instance is deleted. A method that
    is not allowed in the current state raises `InvalidState` and changes nothing. A method raises `NotEnabled` if it needs a device
    that is not enabled, and `SecondWriter` if it would write a variable that another instance claims; a start during a latched stop
    raises `EmergencyStopped`.
    """

    def __init__(self, verb: Verb[..., R], system: System, identity: int, objects: Mapping[str, Any], once: bool) -> None:
        self.verb = verb
        self.system = system
        self.identity = identity
        self._objects = objects
        self._once = once
        self._deleted = False
        self._halt_asked = False
        self._report: R | None = None
        self._name: str | None = None

    @property
    def name(self) -> str:
        """Name of the instance. If none was set, a name such as `move#3` is generated."""
        if self._name is None:
            self._name = str(self._about()["name"])
        return self._name

    @property
    def state(self) -> str:
        """State: `created`, `queued` (started, and waiting for claims held by others), `running`, `suspended`, `ended` or `deleted`."""
        if self._deleted:
            return "deleted"
        with refusals:
            return self.system._native.state(self.identity)

    @property
    def done(self) -> bool:
        """True if the latest start has ended."""
        return self.state in ("ended", "deleted")

    @property
    def report(self) -> R | None:
        """Report of the latest start, or None before its end. It remains readable after `delete`."""
        if self._report is None and not self._deleted:
            with refusals:
                text = waiting.reported(self.system._native, self.identity)
            if text is not None:
                self._take(text)
        return self._report

    @property
    def inputs(self) -> dict[str, Any]:
        """Current values of the input parameters by name, in SI units: the values of the latest start, updated by `set`.

        Before the first start they are the defaults, or None for an input parameter without a default.
        """
        return dict(self._about()["inputs"])

    def start(self, *args: Any, **kwargs: Any) -> Self:
        """Starts the instance with new input values; omitted input parameters take their defaults. `time_limit=` ends the instance after
        that time.

        Returns when all claims are acquired; the initial list begins with the next firings of the sources. A remote processor may
        start later than one in this process: if the order of two starts matters, wait until the first has stored a value.
        """
        options = options_json(kwargs, self.verb)
        try:
            bound = self.verb.inputs_signature.bind(*args, **kwargs)
        except TypeError as error:
            self.verb.refused_call(error, kwargs)
            raise
        self._start(values_json(self.verb, bound.arguments, self._objects), options)
        return self

    def wait(self, timeout: Quantity | None = None) -> R:
        """Waits for the end and returns the report. Raises an exception if the end is not normal, and `TimeoutError` after `timeout`;
        the instance then keeps running.

        Deletes an instance that was created by `asynch`. Ctrl-C ends only the wait, not the instance.
        """
        if self._deleted and self._report is None:
            refuse(InvalidState, f"verb instance '{self._name}' has been deleted", "create another one: new_instance(...)")
        text = None if self._deleted else waiting.wait(self, optional_ns(timeout, "the timeout"))
        return self._finish(text)

    def suspend(self) -> None:
        """Stops the blocks without synchronous inputs, waits until the blocks that they drive have processed all pending values, and
        returns.

        The verb's `suspend=` defines the behaviour of its actuators in the meantime. Raises `InvalidState` if the instance is already
        ending.
        """
        with refusals:
            self._alive().suspend(self.identity)

    def resume(self) -> None:
        """Resumes a suspended instance."""
        with refusals:
            self._alive().resume(self.identity)

    def halt(self) -> None:
        """Halts the instance: reports the condition `halted`, which may have a transition, and runs the ending list. Returns when the
        instance has ended.

        A second halt acts immediately. A queued instance is removed from the queue.
        """
        self._halt_asked = True
        with refusals:
            self._alive().halt(self.identity)

    def delete(self) -> None:
        """Frees all resources on the real-time system; the report remains readable."""
        native = self._alive()
        _ = self.report, self.name
        with refusals:
            native.delete(self.identity)
        self._deleted = True

    def set(self, **values: Any) -> None:
        """Changes tunable input parameters, `vi.set(speed=0.2)`, and tunable intervals, `vi.set(every={"near": "10 ms"})`, while the
        verb runs.

        All changes take effect together, between two firings of each source. A new interval takes effect at its next multiple, and
        applies until the end of this start. If the new rates are infeasible, the call is refused and nothing changes.
        """
        every = values.pop("every", {}) if "every" not in self.verb.input_parameters else {}
        if not isinstance(every, Mapping):
            refuse(CallError, f"every= must be a dictionary, not {every!r}", "write vi.set(every={'generator': '10 ms'})")
        intervals = {str(label): span_ns(time, f"the interval of '{label}'") for label, time in every.items()}
        with refusals:
            self._alive().set(self.identity, {name: plain(value, f"'{name}'") for name, value in values.items()}, intervals)

    def _instead(self, name: str) -> str:
        return f"write vi.set({name}=…)" if name in self.verb.input_parameters else ""

    def _called(self) -> str:
        return f"an instance of verb '{self.verb.name}'"

    def __await__(self) -> Generator[Any, None, R]:
        """Waits without blocking the event loop; cancelling the waiting task halts the instance."""
        # Importing an event loop takes an eighth of the start-up time of a program without one.
        from .awaiting import wait_async

        return wait_async(self).__await__()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._deleted or self.system.closed:
            return
        if self.state in ("queued", "running", "suspended"):
            self.halt()
        if not self._deleted:
            self.delete()

    def _alive(self) -> Any:
        if self._deleted:
            refuse(InvalidState, f"verb instance '{self._name}' has been deleted", "create another one: new_instance(...)")
        return self.system._native

    def _start(self, values: Mapping[str, Any], options: Mapping[str, Any]) -> None:
        native = self._alive()
        with refusals:
            native.start(self.identity, values, options)
        self.system._say_rights()
        self._report, self._halt_asked = None, False

    def _take(self, text: str) -> R:
        report: Any = self.verb.report_class(json.loads(text))
        self._report, self._name = report, report.instance
        return report

    def _finish(self, text: str | None) -> R:
        """Stores an end report, and deletes a single-use instance. Raises the exception of the termination condition if the end is not
        normal."""
        report: Any = self._report if text is None else self._take(text)
        if self._once and not self._deleted:
            self.delete()
        asked = report.condition == "halted" and self._halt_asked
        if not (report.normal or asked):
            raise terminated(report, self.verb, self._objects)
        return report

    def _about(self) -> dict[str, Any]:
        with refusals:
            return self.system._native.instance(self.identity)

    def _table(self) -> Table | None:
        if self._deleted or self.system.closed:
            return None
        about = self._about()
        rows = [(b["label"], b["block"], b["source"]) for b in about.get("blocks", [])]
        where = f" in list '{about['list']}'" if about.get("list") else ""
        running = f", running for {about['running_s']:.6g} s" if "running_s" in about else ""
        return Table(f"{about['name']} of {self.verb.name}: {about['state']}{where}{running}", ["block", "what", "source"], rows)

    def __repr__(self) -> str:
        if self.system.closed:
            return f"verb instance of {self.verb.name} in the closed system '{self.system.name}'"
        if self._deleted:
            return f"verb instance {self._name}: deleted; {self._report!r}"
        try:
            about = self._about()
        except Error as error:
            return f"verb instance {self._name or ''} of {self.verb.name}: {gone(error)}"
        blocks = "".join(f"\n  {b['label']}: {b['block']} on {b['source']}" for b in about.get("blocks", []))
        where = f" in list '{about['list']}'" if about.get("list") else ""
        return f"verb instance {about['name']} of {self.verb.name}: {about['state']}{where}{blocks}"


def _create(verb: Verb[..., R], bound: Any, once: bool) -> VerbInstance[R]:
    system = system_for(verb, bound.arguments)
    application = application_json(verb, bound)
    native = system._alive()
    system._enter_verb(verb)
    with refusals:
        identity = native.create(application)
    objects = {name: given for name, given in bound.arguments.items() if name in verb.objects}
    return VerbInstance(verb, system, identity, objects, once)


def create(verb: Verb[..., R], args: Any, kwargs: dict[str, Any]) -> VerbInstance[R]:
    """Creates an instance, for `verb.new_instance(...)`."""
    if checking.active():
        return cast("VerbInstance[R]", plan(verb, args, kwargs, verb.arguments_signature))
    return _create(verb, bind(verb, verb.arguments_signature, args, kwargs), once=False)


def start(verb: Verb[..., R], args: Any, kwargs: dict[str, Any]) -> VerbInstance[R]:
    """Creates and starts an instance, for `verb.asynch(...)`; deletes it again if the start fails."""
    verb = verb._fitting(args, kwargs)
    if checking.active():
        return cast("VerbInstance[R]", plan(verb, args, kwargs, verb.signature))
    options = options_json(kwargs, verb)
    bound = bind(verb, verb.signature, args, kwargs)
    instance = _create(verb, bound, once=True)
    try:
        instance._start(values_json(verb, bound.arguments, instance._objects), options)
    except BaseException:
        _drop(instance)
        raise
    return instance


def _drop(instance: VerbInstance[Any]) -> None:
    """Ends and deletes an instance, which may or may not have been started, because a `KeyboardInterrupt` can arrive at any line."""
    if instance.state in ("queued", "running", "suspended"):
        with contextlib.suppress(InvalidState):
            instance.halt()
    if not instance._deleted:
        instance.delete()


def call(verb: Verb[..., R], args: Any, kwargs: dict[str, Any]) -> R:
    """Calls a verb, for `verb(...)`. On Ctrl-C, halts the instance, waits for its report, deletes it, and re-raises `KeyboardInterrupt`.

    A short verb needs only a single request to the real-time system; the call waits for a longer one as `wait` does.
    """
    verb = verb._fitting(args, kwargs)
    if checking.active():
        return start(verb, args, kwargs).wait()
    options, prepared = options_json(kwargs, verb), PreparedCall.of(verb)
    try:
        given = prepared.bound(verb, args, kwargs)
    except TypeError as error:
        verb.refused_call(error, kwargs)
        raise
    system = system_for(verb, given)
    native = system._alive()
    objects = {name: given[name] for name in verb.objects if name in given}
    arguments, values = arguments_json(verb, given), values_json(verb, given, objects)
    system._enter_verb(verb)
    made: list[int] = []
    instance: VerbInstance[R] | None = None
    try:
        with refusals:
            text = native.performing(prepared.request(verb, arguments, values, options), made, progress.SLICE_NS)
        system._say_rights()
        if text is not None:
            return _ended(verb, text, objects)
        instance = VerbInstance(verb, system, made[0], objects, once=True)
        return instance.wait()
    except KeyboardInterrupt:
        if instance is None and made:
            instance = VerbInstance(verb, system, made[0], objects, once=True)
        if instance is not None and instance.state != "deleted":
            _drop(instance)
        raise


def _ended(verb: Verb[..., R], text: str, objects: Mapping[str, Any]) -> R:
    """Returns the report of a finished call. Raises the exception of the termination condition if the end is not normal."""
    report: Any = verb.report_class(_read(text)[0])
    if not report.normal:
        raise terminated(report, verb, objects)
    return report
