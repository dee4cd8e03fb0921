// SPDX-License-Identifier: Apache-2.0
// With other_definition.cpp, a program that breaks the one-definition rule.
namespace hotpath {

struct Record {
  int a = 1;
  int value() const { return a; }
};

int other_value();

}  // namespace hotpath

int main() { return hotpath::Record().value() - hotpath::other_value(); }
