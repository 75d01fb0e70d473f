"""What is not carried over: where, what, and what to do about it. Standard library only."""


class Report:
    def __init__(self):
        self.entries = []

    def add(self, where, what, remedy):
        entry = (where, what, remedy)
        if entry not in self.entries:
            self.entries.append(entry)

    def text(self):
        if not self.entries:
            return "Everything is carried over.\n"
        count = "1 thing is" if len(self.entries) == 1 else f"{len(self.entries)} things are"
        lines = [f"{count} not carried over:"]
        lines += [f"- {where}: {what}. Remedy: {remedy}." for where, what, remedy in self.entries]
        return "\n".join(lines) + "\n"
