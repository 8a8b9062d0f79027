// SPDX-License-Identifier: Apache-2.0
// A programming system in C: it configures a real-time system, enters a verb, runs it, and prints the report.
//
//     cc servo.c -I../../crates/c-package/include -L../../target/release -lopengpac_ps -o servo && ./servo
//
// The verb is a servo: it brings an axis to a goal, and ends when the axis is there.
#include <opengpac_ps.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static opengpac_system *cell;

// Makes a call and gives its result; the program ends where it is refused.
static char *call(const char *name, const char *arguments)
{
    char *result = opengpac_call(cell, name, arguments);
    if (result) return result;
    fprintf(stderr, "%s was refused: %s\n", name, opengpac_error());
    opengpac_close(cell);
    exit(1);
}

static void command(const char *name, const char *arguments)
{
    opengpac_free(call(name, arguments));
}

static const char *SERVO =
    "{\"name\": \"bring\", \"doc\": \"Brings an axis to a goal.\","
    " \"blocks\": {"
    "   \"read\":  {\"block\": {\"subroutine\": \"library.read_channel\"}},"
    "   \"goal\":  {\"block\": {\"subroutine\": \"library.signal_generator\"}, \"constants\": {\"shape\": 0}},"
    "   \"pid\":   {\"block\": {\"subroutine\": \"library.pid\"}, \"constants\": {\"kp\": 20.0, \"limit\": 2.0}},"
    "   \"write\": {\"block\": {\"subroutine\": \"library.write_channel\"}},"
    "   \"clock\": {\"block\": {\"subroutine\": \"library.time_limit\"}}},"
    " \"instantiation_parameters\": {"
    "   \"position\": [\"read.channel\"], \"effort\": [\"write.channel\"], \"sensed\": [\"read.y\", \"pid.measured\"]},"
    " \"cells\": {\"setpoint\": [\"goal.y\", \"pid.setpoint\"], \"speed\": [\"pid.effort\", \"write.u\"]},"
    " \"input_parameters\": {\"goal\": {\"targets\": [\"goal.offset\"]}, \"seconds\": {\"targets\": [\"clock.limit\"], \"default\": 1.0}},"
    " \"output_values\": {\"reached\": \"read.y\"},"
    " \"command_lists\": {\"start\": {\"commands\": ["
    "   {\"command\": \"activate\", \"block\": \"read\", \"every_ns\": 1000000},"
    "   {\"command\": \"activate\", \"block\": \"goal\", \"every_ns\": 1000000},"
    "   {\"command\": \"activate\", \"block\": \"pid\"},"
    "   {\"command\": \"activate\", \"block\": \"write\"},"
    "   {\"command\": \"activate\", \"block\": \"clock\", \"every_ns\": 1000000}]}},"
    " \"conditions\": {\"there\": {\"on\": [\"clock.expired\"], \"returns\": [\"reached\"]}}}";

int main(void)
{
    cell = opengpac_open("servo_in_c", "virtual", "{}");
    if (!cell) {
        fprintf(stderr, "%s\n", opengpac_error());
        return 1;
    }

    // Configuration phase: hardware, then software.
    command("processor", "{\"name\": \"rtp0\"}");
    command("source", "{\"processor\": \"rtp0\", \"name\": \"fast\", \"kind\": \"timer\", \"period_ns\": 1000000, \"priority\": 80}");
    command("physical_device", "{\"processor\": \"rtp0\", \"name\": \"drive\", \"kind\": \"loopback\", \"options\": {\"parts\": [\"axis\"]},"
                               " \"source\": \"rtp0.fast\"}");
    command("svv", "{\"name\": \"sensed\", \"type_text\": \"double\", \"unit\": \"rad\", \"history\": 100}");
    command("define_verb", SERVO);

    // What is wrong is refused with a sentence, and nothing has changed.
    if (opengpac_call(cell, "create", "{\"verb\": \"brings\"}")) return 1;
    printf("refused: %s\n", opengpac_error());

    // Execution phase: create once, start twice, each time with another goal.
    char *instance = call("create", "{\"verb\": \"bring\", \"placement\": {\"*\": \"rtp0.fast\"}, \"arguments\": {"
                                    "\"position\": {\"channel\": {\"device\": \"drive\", \"channel\": \"axis.position\"}},"
                                    "\"effort\": {\"channel\": {\"device\": \"drive\", \"channel\": \"axis.effort\"}},"
                                    "\"sensed\": {\"svv\": \"sensed\"}}}");
    const char *goals[] = {"0.5", "-0.25"};
    for (int k = 0; k < 2; k++) {
        char arguments[200];
        snprintf(arguments, sizeof arguments, "{\"instance\": %s, \"values\": {\"goal\": %s}}", instance, goals[k]);
        command("start", arguments);
        snprintf(arguments, sizeof arguments, "{\"instance\": %s, \"timeout_ns\": 5000000000}", instance);
        char *report = call("wait", arguments);
        printf("report: %s\n", report);
        opengpac_free(report);
        char *snapshot = call("read", "{\"names\": [\"sensed\"]}");
        printf("sensed: %s\n", snapshot);
        opengpac_free(snapshot);
    }
    char arguments[100];
    snprintf(arguments, sizeof arguments, "{\"instance\": %s}", instance);
    command("delete", arguments);
    opengpac_free(instance);
    opengpac_close(cell);
    return 0;
}
