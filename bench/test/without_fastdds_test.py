# SPDX-License-Identifier: Apache-2.0
"""A build without Fast DDS measures within one process, and reports its missing features."""

from hotpath_command import CommandTest, ONE


class WithoutFastDds(CommandTest):
    def test_measures_within_one_process(self) -> None:
        for graph in ("autoware", "callbacks"):
            with self.subTest(graph=graph):
                output = self.folder / graph
                length = ("--duration", 1, "--warm-up", 0, "--load", 10)
                self.accepted(
                    "run", *ONE, "--graph", graph, "--transport", "intra_process", *length, "--output", output
                )
                run = self.checked(output)
                self.assertGreater(len(run.rows("jobs.csv")), 50)
                self.assertGreater(len(run.rows("chains.csv")), 5)

    def test_says_what_it_lacks(self) -> None:
        self.refused("run", "--duration", 1, says="--transport intra_process")
        self.refused("run", "--transport", "intra_process", "--live", says="--live")
        self.refused("replay", "run", says="built without it")
