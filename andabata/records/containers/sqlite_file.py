"""Reader of a ROS 2 recording's sqlite3 file, with any version of its tables."""

import shutil
import sqlite3
import tempfile
from collections.abc import Collection, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

from andabata.records.containers.container import (
    BagError,
    Connection,
    Damage,
    RawMessage,
    is_latched,
    ros_type_name,
)

MAGIC = b"SQLite format 3\0"
"""First bytes of a file of sqlite3."""

_JOURNAL = "-journal"
"""Suffix of a rollback journal, which holds the pages as they were before a commit."""

_STEP = 256
"""Number of rows read at once; where one of their pages is damaged, rows are read singly."""


class SqliteFile:
    """Reader of a ``.db3`` file.

    Attributes:
        connections: Topics, as connections.
        counts: Number of whole messages of each topic.
        damage: Parts that cannot be read.
        lost: Number of messages in damaged pages; None if it is unknown.
        notes: Facts that a user should know although no message is missing.
        database: Open database.
    """

    def __init__(self, path: Path) -> None:
        """Open and scan a file.

        Raises:
            BagError: If the file is no recording.
        """
        self.path = path
        self.damage: list[Damage] = []
        self.notes: list[str] = []
        self.finished = True
        self.lost: int | None = 0
        self.database = open_database(path)
        try:
            self._scan()
        except sqlite3.DatabaseError as error:
            self.close()
            raise BagError(
                f"{path}: expected a ROS 2 recording's sqlite3 file, got one of which {error}; "
                "`sqlite3 FILE .recover` may save what is left of it"
            ) from error
        except BaseException:
            self.close()
            raise

    def _scan(self) -> None:
        """Read the topics and count the messages."""
        tables = {name for (name,) in self.database.execute("SELECT name FROM sqlite_master")}
        if not {"topics", "messages"} <= tables:
            raise BagError(
                f"{self.path}: expected a ROS 2 recording with the tables topics and messages, "
                f"got {', '.join(sorted(tables)) or 'no table'}"
            )
        definitions = self._definitions() if "message_definitions" in tables else None
        rows = self.database.execute("SELECT * FROM topics ORDER BY id")
        names = [column[0] for column in rows.description]
        topics = [dict(zip(names, row, strict=True)) for row in rows]
        self._ids = [int(topic["id"]) for topic in topics]
        self.connections = [_connection(topic, definitions) for topic in topics]
        self._whole = True
        if "metadata" in tables:
            self._check_end()
        try:
            query = "SELECT topic_id, count(*) FROM messages GROUP BY topic_id"
            counts = dict(self.database.execute(query).fetchall())
            # A full pass over the pages: an index may be whole where a page of data is not.
            (found_whole,) = self.database.execute("PRAGMA quick_check(1)").fetchone()
            if found_whole != "ok":
                raise sqlite3.DatabaseError(found_whole)
        except sqlite3.DatabaseError as error:
            counts = self._count_whole(str(error))
        self.counts = [int(counts.get(number, 0)) for number in self._ids]
        orphaned = sum(counts.values()) - sum(self.counts)
        if orphaned:
            reason = "expected a topic of each message, got none for some"
            self.damage.append(Damage(0, 0, reason, orphaned))
            self.lost = None if self.lost is None else self.lost + orphaned

    def _check_end(self) -> None:
        """Note a file whose recorder did not finish: it writes the metadata at the end."""
        (rows,) = self.database.execute("SELECT count(*) FROM metadata").fetchone()
        self.finished = rows > 0
        if not self.finished:
            self.notes.append("no metadata: the recorder did not finish")

    def _definitions(self) -> dict[str, tuple[str, str]]:
        """Return definition and format of it by message type."""
        query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        return {kind: (str(text), str(form)) for kind, form, text in self.database.execute(query)}

    def _count_whole(self, reason: str) -> dict[int, int]:
        """Return the number of readable messages by topic of a damaged file."""
        self._whole = False
        counts: dict[int, int] = {}
        self._skipped = 0
        for row in self.rows("topic_id"):
            counts[row[1]] = counts.get(row[1], 0) + 1
        self.lost = self._skipped or None
        self.damage.append(Damage(0, 0, f"expected a whole database, got {reason}", self.lost))
        return counts

    def rows(self, columns: str) -> Iterator[tuple[Any, ...]]:
        """Yield rowid and columns of the readable messages, in the order of their rowids.

        Args:
            columns: Names of columns, separated by commas.
        """
        self._skipped = 0
        last = self._last_row()
        # The query for the last byte of each message makes sqlite3 read all of its pages.
        query = f"SELECT rowid, {columns}, length(substr(data, -1)) FROM messages WHERE rowid "
        begin = 1
        while begin <= last:
            end = min(begin + _STEP, last + 1)
            try:
                yield from self.database.execute(
                    f"{query} >= ? AND rowid < ? ORDER BY rowid", (begin, end)
                ).fetchall()
            except sqlite3.DatabaseError:
                for number in range(begin, end):
                    try:
                        yield from self.database.execute(f"{query} = ?", (number,)).fetchall()
                    except sqlite3.DatabaseError:
                        self._skipped += 1
            begin = end

    def _last_row(self) -> int:
        """Return the greatest rowid, or the number of rows where the greatest cannot be read.

        Raises:
            BagError: If neither can be read.
        """
        for query in ("SELECT max(rowid) FROM messages", "SELECT count(*) FROM messages"):
            try:
                return int(self.database.execute(query).fetchone()[0] or 0)
            except sqlite3.DatabaseError:
                continue
        raise BagError(
            f"{self.path}: expected messages, got none that can be read; "
            "`sqlite3 FILE .recover` may save what is left of it"
        )

    def read(self, wanted: Collection[int]) -> Iterator[RawMessage]:
        """Yield the messages of some topics in the order of their times of recording."""
        indices = {self._ids[k]: k for k in wanted}
        marks = ",".join("?" * len(indices))
        query = (
            "SELECT topic_id, timestamp, data FROM messages "
            f"WHERE topic_id IN ({marks}) ORDER BY timestamp, rowid"
        )
        if self._whole:
            for number, stamp, data in self.database.execute(query, tuple(indices)):
                yield RawMessage(indices[number], int(stamp), bytes(data))
            return
        rows = [row for row in self.rows("topic_id, timestamp") if row[1] in indices]
        for rowid, number, stamp, _ in sorted(rows, key=lambda row: (row[2], row[0])):
            data = self.database.execute("SELECT data FROM messages WHERE rowid = ?", (rowid,))
            yield RawMessage(indices[number], int(stamp), bytes(data.fetchone()[0]))

    def close(self) -> None:
        """Close the file."""
        self.database.close()


def open_database(path: Path) -> sqlite3.Connection:
    """Open a database, which stays as it is.

    The rows that a killed recorder left in a log beside the file are read, too, if the folder is
    writable: sqlite3 needs a shared-memory file there. Otherwise the file alone is read. A recorder
    that was killed in the middle of a commit leaves a half written file and a rollback journal:
    then a copy is read in which that commit is undone.
    """
    uri = path.resolve().as_uri()
    for mode in ("mode=ro", "mode=ro&immutable=1"):
        database = sqlite3.connect(f"{uri}?{mode}", uri=True)
        try:
            database.execute("SELECT name FROM sqlite_master").fetchall()
        except sqlite3.OperationalError as error:
            database.close()
            if error.sqlite_errorcode == sqlite3.SQLITE_READONLY_ROLLBACK:
                return _rolled_back(path)
            continue
        except sqlite3.DatabaseError:
            pass
        return database
    return sqlite3.connect(f"{uri}?mode=ro&immutable=1", uri=True)


def _rolled_back(path: Path) -> sqlite3.Connection:
    """Open a copy of a database whose last commit, half written, is undone."""
    with tempfile.TemporaryDirectory(prefix="andabata-") as folder:
        copy = Path(folder) / path.name
        for suffix in ("", _JOURNAL):
            shutil.copyfile(f"{path}{suffix}", f"{copy}{suffix}")
        database = sqlite3.connect(copy)
        with suppress(sqlite3.DatabaseError):
            # The first access undoes the commit; the file stays open after its name is gone.
            database.execute("SELECT name FROM sqlite_master").fetchall()
        return database


def _connection(
    topic: dict[str, Any], definitions: dict[str, tuple[str, str]] | None
) -> Connection:
    """Return a topic as a connection."""
    kind = str(topic["type"])
    # Recorders before Iron write no definitions: types are those of the distribution.
    text, form = (definitions or {}).get(kind, ("", "standard"))
    encoding = str(topic.get("serialization_format", "cdr"))
    qos = str(topic.get("offered_qos_profiles", ""))
    return Connection(
        str(topic["name"]), ros_type_name(kind), encoding, text, form, "", is_latched(qos), qos
    )
