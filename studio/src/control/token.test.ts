// SPDX-License-Identifier: Apache-2.0
import { expect, test } from "vitest";
import { tokenIn } from "./token";

test("the token is taken out of the fragment, and the route stays", () => {
  expect(tokenIn("#token=abc")).toEqual({ token: "abc", rest: "" });
  expect(tokenIn("#/scope?names=a&token=a%2Bb")).toEqual({ token: "a+b", rest: "#/scope?names=a" });
  expect(tokenIn("#/scope")).toBeNull();
  expect(tokenIn("")).toBeNull();
});
