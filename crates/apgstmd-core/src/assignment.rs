//! Who belongs to whom: the one-to-one matching of greatest total weight among pairs that may match at all.
//!
//! Pairs fall into groups that share nothing; each is solved on its own by the Kuhn-Munkres algorithm, so that thousands
//! of rows and columns of which each has few partners cost little. Weights are whole numbers: no result hangs on the
//! order of a sum.

use pathfinding::prelude::{Matrix, kuhn_munkres};

/// A row and a column that may be matched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Pair {
    pub row: usize,
    pub column: usize,
    /// What the match is worth, above 0.
    pub weight: i64,
}

impl Pair {
    /// A worth in [0, 1e6] with some nine decimals. The least still is better than no match.
    pub fn new(row: usize, column: usize, worth: f64) -> Self {
        const UNIT: f64 = (1u64 << 30) as f64;
        Self { row, column, weight: ((worth * UNIT).round() as i64).max(1) }
    }
}

/// A solver whose memory is used again.
#[derive(Debug)]
pub(crate) struct Assignment {
    /// Groups with more rows and more columns than this are matched greedily, the greatest weight first.
    most: usize,
    /// Column of each row.
    pub of_row: Vec<Option<usize>>,
    taken: Vec<bool>,
    /// Union-find over rows, then columns.
    parent: Vec<usize>,
    order: Vec<usize>,
    /// Place of a row or column in its group.
    local: Vec<usize>,
    members: [Vec<usize>; 2],
}

impl Assignment {
    /// Optimal whatever the size.
    pub fn exact() -> Self {
        Self::with_most(usize::MAX)
    }

    /// Optimal in groups of up to `most` rows or columns.
    pub fn with_most(most: usize) -> Self {
        Self {
            most,
            of_row: Vec::new(),
            taken: Vec::new(),
            parent: Vec::new(),
            order: Vec::new(),
            local: Vec::new(),
            members: [Vec::new(), Vec::new()],
        }
    }

    /// Matches `rows` with `columns`; the result is in `of_row`. Each pair at most once.
    pub fn solve(&mut self, rows: usize, columns: usize, pairs: &[Pair]) {
        self.of_row.clear();
        self.of_row.resize(rows, None);
        self.taken.clear();
        self.taken.resize(columns, false);
        self.parent.clear();
        self.parent.extend(0..rows + columns);
        for pair in pairs {
            let (a, b) = (self.root(pair.row), self.root(rows + pair.column));
            self.parent[a.max(b)] = a.min(b);
        }
        // Parents come before their children: one pass leads every node to its root.
        (0..self.parent.len()).for_each(|node| self.parent[node] = self.parent[self.parent[node]]);
        let mut order = std::mem::take(&mut self.order);
        order.clear();
        order.extend(0..pairs.len());
        order.sort_unstable_by_key(|&i| (self.parent[pairs[i].row], i));
        let mut rest = &order[..];
        while let Some(first) = rest.first() {
            let root = self.parent[pairs[*first].row];
            let (group, others) = rest.split_at(rest.partition_point(|&i| self.parent[pairs[i].row] == root));
            self.solve_group(rows, group, pairs);
            rest = others;
        }
        self.order = order;
    }

    fn root(&mut self, mut node: usize) -> usize {
        while self.parent[node] != node {
            self.parent[node] = self.parent[self.parent[node]];
            node = self.parent[node];
        }
        node
    }

    fn solve_group(&mut self, rows: usize, group: &[usize], pairs: &[Pair]) {
        self.local.resize(self.parent.len().max(self.local.len()), 0);
        let [of_rows, of_columns] = &mut self.members;
        of_rows.clear();
        of_columns.clear();
        of_rows.extend(group.iter().map(|&i| pairs[i].row));
        of_columns.extend(group.iter().map(|&i| pairs[i].column));
        for members in &mut self.members {
            members.sort_unstable();
            members.dedup();
        }
        let [of_rows, of_columns] = &self.members;
        let (height, width) = (of_rows.len(), of_columns.len());
        if height.min(width) == 1 || height.min(width) > self.most {
            return self.greedy(group, pairs);
        }
        of_rows.iter().enumerate().for_each(|(i, row)| self.local[*row] = i);
        of_columns.iter().enumerate().for_each(|(i, column)| self.local[rows + *column] = i);
        // No row of the matrix is left out, so it must not have more rows than columns.
        let wide = height <= width;
        let mut weights = Matrix::new(height.min(width), height.max(width), 0i64);
        for &i in group {
            let at = (self.local[pairs[i].row], self.local[rows + pairs[i].column]);
            weights[if wide { at } else { (at.1, at.0) }] = pairs[i].weight;
        }
        let (_, matched) = kuhn_munkres(&weights);
        for (i, j) in matched.into_iter().enumerate().filter(|at| weights[*at] > 0) {
            let (row, column) = if wide { (i, j) } else { (j, i) };
            self.of_row[of_rows[row]] = Some(of_columns[column]);
        }
    }

    /// The greatest weight first; of equal ones the first pair.
    fn greedy(&mut self, group: &[usize], pairs: &[Pair]) {
        let mut sorted = std::mem::take(&mut self.members[0]);
        sorted.clear();
        sorted.extend(group);
        sorted.sort_unstable_by_key(|&i| (std::cmp::Reverse(pairs[i].weight), i));
        for Pair { row, column, .. } in sorted.iter().map(|&i| pairs[i]) {
            if self.of_row[row].is_none() && !self.taken[column] {
                self.of_row[row] = Some(column);
                self.taken[column] = true;
            }
        }
        self.members[0] = sorted;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn total(of_row: &[Option<usize>], pairs: &[Pair]) -> i64 {
        let weight = |(row, column): (usize, &Option<usize>)| {
            let column = (*column)?;
            Some(pairs.iter().find(|p| (p.row, p.column) == (row, column)).expect("only pairs are matched").weight)
        };
        of_row.iter().enumerate().filter_map(weight).sum()
    }

    /// Every matching there is.
    fn brute_force(row: usize, rows: usize, taken: &mut Vec<usize>, pairs: &[Pair]) -> i64 {
        if row == rows {
            return 0;
        }
        let mut best = brute_force(row + 1, rows, taken, pairs);
        for pair in pairs.iter().filter(|p| p.row == row) {
            if !taken.contains(&pair.column) {
                taken.push(pair.column);
                best = best.max(pair.weight + brute_force(row + 1, rows, taken, pairs));
                taken.pop();
            }
        }
        best
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]
        #[test]
        fn the_total_is_the_greatest(
            (rows, columns) in (0..6usize, 0..6usize),
            cells in prop::collection::vec((0..6usize, 0..6usize, 1..9i64), 0..20),
        ) {
            let mut pairs: Vec<Pair> =
                cells.into_iter().map(|(row, column, weight)| Pair { row, column, weight }).collect();
            pairs.retain(|p| p.row < rows && p.column < columns);
            pairs.sort_unstable_by_key(|p| (p.row, p.column));
            pairs.dedup_by_key(|p| (p.row, p.column));
            let mut assignment = Assignment::exact();
            // Memory of an earlier call must not show.
            assignment.solve(3, 3, &[Pair { row: 2, column: 1, weight: 7 }, Pair { row: 1, column: 1, weight: 3 }]);
            assignment.solve(rows, columns, &pairs);
            let mut columns: Vec<usize> = assignment.of_row.iter().flatten().copied().collect();
            let count = columns.len();
            columns.sort_unstable();
            columns.dedup();
            prop_assert_eq!(columns.len(), count, "one to one");
            prop_assert_eq!(total(&assignment.of_row, &pairs), brute_force(0, rows, &mut Vec::new(), &pairs));
            let mut greedy = Assignment::with_most(0);
            greedy.solve(rows, 6, &pairs);
            prop_assert!(2 * total(&greedy.of_row, &pairs) >= total(&assignment.of_row, &pairs));
        }
    }
}
